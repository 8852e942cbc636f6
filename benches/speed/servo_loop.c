/* The two-axis servo loop as one would write it by hand in C: the yardstick of `cargo bench`.
 *
 * usage: servo_loop PASSES < setpoints     (n pairs of doubles, binary)
 * prints: nanoseconds a two-axis step, sum of |actual| of the last pass
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct {
    double kpp, kpv, kiv, kpf, kvf;          /* gains */
    double a, b, K, tau;                     /* plant over one period */
    double theta, omega, integral, last;     /* state */
} axis_t;

static const double RG = 1.59, KT = 1.0 / 0.716, UMAX = 5.0, DT = 1e-3;

static axis_t make(double K, double tau, double kpp, double kpv, double kiv, double kpf, double kvf) {
    axis_t ax = {kpp, kpv, kiv, kpf, kvf, exp(-DT / tau), 0, K, tau, 0, 0, 0, 0};
    ax.b = tau * (1 - ax.a);
    return ax;
}

static inline double step(axis_t *ax, double command, double *voltage) {
    double actual = RG * ax->theta;
    double rate = (command - ax->last) / DT;
    ax->last = command;
    double omega_com = ax->kpp * (command - actual) + ax->kpf * rate;
    double torque = ax->kpv * (ax->kvf * omega_com - ax->omega + ax->kiv * ax->integral);
    double wanted = KT * torque;
    double u = wanted > UMAX ? UMAX : wanted < -UMAX ? -UMAX : wanted;
    double error = omega_com - ax->omega;
    if (!(u != wanted && error * wanted > 0)) ax->integral += DT * error;
    double end = ax->K * u;
    ax->theta += end * DT + (ax->omega - end) * ax->b;
    ax->omega = end + (ax->omega - end) * ax->a;
    *voltage = u;
    return actual;
}

int main(int argc, char **argv) {
    long passes = argc > 1 ? atol(argv[1]) : 1;
    size_t room = 1 << 22, n = 0;
    double *setpoints = malloc(room * sizeof(double));
    n = fread(setpoints, 2 * sizeof(double), room / 2, stdin);
    double *out = malloc(4 * n * sizeof(double));
    double sum = 0;
    struct timespec t0, t1;
    clock_gettime(CLOCK_MONOTONIC, &t0);
    for (long pass = 0; pass < passes; pass++) {
        axis_t x = make(83.0089, 0.19936, 97.38, 1.19, 252.8, 0.8, 0.85);
        axis_t y = make(50.4977, 0.15641, 97.38, 1.53, 253.2, 0.8, 0.85);
        for (size_t k = 0; k < n; k++) {
            out[4 * k] = step(&x, setpoints[2 * k], &out[4 * k + 1]);
            out[4 * k + 2] = step(&y, setpoints[2 * k + 1], &out[4 * k + 3]);
        }
    }
    clock_gettime(CLOCK_MONOTONIC, &t1);
    for (size_t k = 0; k < n; k++) sum += fabs(out[4 * k]) + fabs(out[4 * k + 2]);
    double ns = (t1.tv_sec - t0.tv_sec) * 1e9 + (t1.tv_nsec - t0.tv_nsec);
    printf("%.6f %.15g\n", ns / ((double)passes * n), sum);
    return 0;
}
