/* Many servo loops side by side as one would write them by hand in C: structure of arrays, blocks of vector registers, states
 * in registers, setpoints computed once. The yardstick of the batches of `cargo bench`.
 *
 * usage: batch PASSES < setpoints     (n rows of x, y, their velocities: doubles, binary)
 * prints: nanoseconds a two-axis step of one run, sum of the largest tracking errors
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef __AVX512F__
#define WIDTH 8
#elif defined __AVX__
#define WIDTH 4
#else
#define WIDTH 2
#endif
#ifndef BLOCKS
#define BLOCKS 2
#endif
#define LANES (WIDTH * BLOCKS)

typedef double vec __attribute__((vector_size(8 * WIDTH)));
typedef long long mask __attribute__((vector_size(8 * WIDTH)));

typedef struct {
    vec kpp[BLOCKS], kpf[BLOCKS], direct[BLOCKS], integral_gain[BLOCKS], damping[BLOCKS]; /* gains */
    vec xw[BLOCKS], xu[BLOCKS], ww[BLOCKS], wu[BLOCKS];                                   /* plant over one period */
    vec x[BLOCKS], omega[BLOCKS], integral[BLOCKS];                                       /* state */
} axis_t;

static const double RG = 1.59, KT = 1.0 / 0.716, UMAX = 5.0, DT = 1e-3;

static inline vec all(double v) { return (vec){} + v; }
static inline vec pick(mask m, vec a, vec b) { return (vec)(((mask)a & m) | ((mask)b & ~m)); }

static void make(axis_t *ax, int i, int l, double K, double tau, double kpp, double kpv, double kiv, double kpf, double kvf) {
    double a = exp(-DT / tau);
    ax->kpp[i][l] = kpp;
    ax->kpf[i][l] = kpf;
    ax->direct[i][l] = KT * kpv * kvf;
    ax->integral_gain[i][l] = KT * kpv * kiv * DT;
    ax->damping[i][l] = KT * kpv;
    ax->xw[i][l] = RG * tau * (1 - a);
    ax->xu[i][l] = RG * K * (DT - tau * (1 - a));
    ax->ww[i][l] = a;
    ax->wu[i][l] = K * (1 - a);
}

static inline __attribute__((always_inline)) void step(axis_t *ax, double command, double rate, vec *worst) {
    for (int i = 0; i < BLOCKS; i++) {
        vec lag = command - ax->x[i];
        vec omega_com = ax->kpp[i] * lag + ax->kpf[i] * rate;
        vec wanted = ax->direct[i] * omega_com + (ax->integral_gain[i] * ax->integral[i] - ax->damping[i] * ax->omega[i]);
        vec u = pick(wanted > all(UMAX), all(UMAX), wanted);
        u = pick(u < all(-UMAX), all(-UMAX), u);
        vec error = omega_com - ax->omega[i];
        mask hold = (u != wanted) & (error * wanted > 0);
        ax->integral[i] += (vec)((mask)error & ~hold);
        ax->x[i] += ax->xw[i] * ax->omega[i] + ax->xu[i] * u;
        ax->omega[i] = ax->ww[i] * ax->omega[i] + ax->wu[i] * u;
        vec size = (vec)((mask)lag & ~(mask)all(-0.0));
        worst[i] = pick(size > worst[i], size, worst[i]);
    }
}

int main(int argc, char **argv) {
    long passes = argc > 1 ? atol(argv[1]) : 1;
    size_t room = 1 << 22;
    double *c = malloc(room * sizeof(double));
    size_t n = fread(c, 4 * sizeof(double), room / 4, stdin);
    double sum = 0, best = 1e300;
    for (int round = 0; round < 5; round++) {
        struct timespec t0, t1;
        clock_gettime(CLOCK_MONOTONIC, &t0);
        sum = 0;
        for (long pass = 0; pass < passes; pass++) {
            axis_t x, y;
            vec wx[BLOCKS], wy[BLOCKS];
            memset(&x, 0, sizeof x);
            memset(&y, 0, sizeof y);
            memset(wx, 0, sizeof wx);
            memset(wy, 0, sizeof wy);
            for (int i = 0; i < BLOCKS; i++)
                for (int l = 0; l < WIDTH; l++) {
                    double kpp = 97.38 * (1 + 0.001 * (i * WIDTH + l));
                    make(&x, i, l, 83.0089, 0.19936, kpp, 1.19, 252.8, 0.8, 0.85);
                    make(&y, i, l, 50.4977, 0.15641, kpp, 1.53, 253.2, 0.8, 0.85);
                }
            for (size_t k = 0; k < n; k++) {
                step(&x, c[4 * k], c[4 * k + 2], wx);
                step(&y, c[4 * k + 1], c[4 * k + 3], wy);
            }
            for (int i = 0; i < BLOCKS; i++)
                for (int l = 0; l < WIDTH; l++) sum += wx[i][l] + wy[i][l];
        }
        clock_gettime(CLOCK_MONOTONIC, &t1);
        double ns = (t1.tv_sec - t0.tv_sec) * 1e9 + (t1.tv_nsec - t0.tv_nsec);
        ns /= (double)passes * n * LANES;
        if (ns < best) best = ns;
    }
    printf("%.6f %.15g\n", best, sum / LANES / passes);
    return 0;
}
