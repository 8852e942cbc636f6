/* Many servo loops side by side as one would write them by hand in C: structure of arrays, states
 * in the first-level cache, setpoints computed once, compiled for the widest vectors of the machine. The yardstick of the batches of `cargo bench`.
 *
 * usage: batch PASSES < setpoints     (n rows of x, y, their velocities: doubles, binary)
 * prints: nanoseconds a two-axis step of one run, and a sum over its figures: largest and mean squared tracking error, peak
 * voltages, saturated samples (what Course::run_loop gives)
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifndef LANES
#define LANES 16
#endif

typedef struct {
    double kpp[LANES], kpf[LANES], direct[LANES], integral_gain[LANES], damping[LANES]; /* gains */
    double xw[LANES], xu[LANES], ww[LANES], wu[LANES];                                  /* plant over one period */
    double x[LANES], omega[LANES], integral[LANES];                                     /* state */
} __attribute__((aligned(64))) axis_t;

typedef struct {
    double worst[LANES], sum[LANES], voltage[2][LANES], saturated[LANES]; /* figures of the runs */
} __attribute__((aligned(64))) tally_t;

static const double RG = 1.59, KT = 1.0 / 0.716, UMAX = 5.0, DT = 1e-3;

static void make(axis_t *ax, int l, double K, double tau, double kpp, double kpv, double kiv, double kpf, double kvf) {
    double a = exp(-DT / tau);
    ax->kpp[l] = kpp;
    ax->kpf[l] = kpf;
    ax->direct[l] = KT * kpv * kvf;
    ax->integral_gain[l] = KT * kpv * kiv * DT;
    ax->damping[l] = KT * kpv;
    ax->xw[l] = RG * tau * (1 - a);
    ax->xu[l] = RG * K * (DT - tau * (1 - a));
    ax->ww[l] = a;
    ax->wu[l] = K * (1 - a);
}

static inline __attribute__((always_inline)) int step(axis_t *ax, double command, double rate, int l, double *square, double *voltage) {
    double lag = command - ax->x[l];
    double omega_com = ax->kpp[l] * lag + ax->kpf[l] * rate;
    double wanted = ax->direct[l] * omega_com + (ax->integral_gain[l] * ax->integral[l] - ax->damping[l] * ax->omega[l]);
    double u = wanted > UMAX ? UMAX : wanted;
    u = u < -UMAX ? -UMAX : u;
    double error = omega_com - ax->omega[l];
    ax->integral[l] = (wanted - u) * error > 0 ? ax->integral[l] : ax->integral[l] + error;
    ax->x[l] += ax->xw[l] * ax->omega[l] + ax->xu[l] * u;
    ax->omega[l] = ax->ww[l] * ax->omega[l] + ax->wu[l] * u;
    *square += lag * lag;
    *voltage = fabs(u) > *voltage ? fabs(u) : *voltage;
    return u != wanted;
}

int main(int argc, char **argv) {
    long passes = argc > 1 ? atol(argv[1]) : 1;
    size_t room = 1 << 22;
    double *c = malloc(room * sizeof(double));
    size_t n = fread(c, 4 * sizeof(double), room / 4, stdin);
    double sum = 0, best = 1e300;
    for (int round = 0; round < 3; round++) {
        struct timespec t0, t1;
        clock_gettime(CLOCK_MONOTONIC, &t0);
        sum = 0;
        for (long pass = 0; pass < passes; pass++) {
            axis_t x, y;
            tally_t t;
            memset(&x, 0, sizeof x);
            memset(&y, 0, sizeof y);
            memset(&t, 0, sizeof t);
            for (int l = 0; l < LANES; l++) {
                double kpp = 97.38 * (1 + 0.001 * l);
                make(&x, l, 83.0089, 0.19936, kpp, 1.19, 252.8, 0.8, 0.85);
                make(&y, l, 50.4977, 0.15641, kpp, 1.53, 253.2, 0.8, 0.85);
            }
            for (size_t k = 0; k < n; k++) {
                const double cx = c[4 * k], cy = c[4 * k + 1], vx = c[4 * k + 2], vy = c[4 * k + 3];
#pragma GCC ivdep
                for (int l = 0; l < LANES; l++) {
                    double square = 0;
                    int saturated = step(&x, cx, vx, l, &square, &t.voltage[0][l]);
                    saturated |= step(&y, cy, vy, l, &square, &t.voltage[1][l]);
                    t.worst[l] = square > t.worst[l] ? square : t.worst[l];
                    t.sum[l] += square;
                    t.saturated[l] += saturated ? 1 : 0;
                }
            }
            for (int l = 0; l < LANES; l++) sum += sqrt(t.worst[l]) + t.sum[l] + t.voltage[0][l] + t.voltage[1][l] + t.saturated[l];
        }
        clock_gettime(CLOCK_MONOTONIC, &t1);
        double ns = (t1.tv_sec - t0.tv_sec) * 1e9 + (t1.tv_nsec - t0.tv_nsec);
        ns /= (double)passes * n * LANES;
        if (ns < best) best = ns;
    }
    printf("%.6f %.15g\n", best, sum / LANES / passes);
    return 0;
}
