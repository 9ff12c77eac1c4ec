#include "trilinear.h"

#if defined(__x86_64__)
#define FUSED __attribute__((target("avx2,fma"))) /* as the compensator */
#else
#define FUSED
#endif

FUSED static inline void interpolate(const trilinear_table* t, const double* restrict p, double* restrict e) {
    const size_t n = (size_t)t->n;
    size_t node[3];
    double after[3];
    for (int a = 0; a < 3; ++a) {
        const double place = p[a] * t->nodes_per_mm[a];
        const int last = t->n - 2, i = (int)place;
        node[a] = (size_t)(i < last ? i : last);
        after[a] = place - (double)node[a];
    }
    const double* const corner = t->errors + 3 * ((node[0] * n + node[1]) * n + node[2]);
    const size_t x = 3 * n * n, y = 3 * n, z = 3;
    const double v = after[1], w = after[2];
    const double weights[4] = {(1 - v) * (1 - w), (1 - v) * w, v * (1 - w), v * w};
    for (size_t c = 0; c < 3; ++c) {
        const double* const q = corner + c;
        const double low = weights[0] * q[0] + weights[1] * q[z] + weights[2] * q[y] + weights[3] * q[y + z];
        const double high =
            weights[0] * q[x] + weights[1] * q[x + z] + weights[2] * q[x + y] + weights[3] * q[x + y + z];
        e[c] = low + after[0] * (high - low);
    }
}

FUSED void trilinear_error(const trilinear_table* table, const double position[3], double error[3]) {
    interpolate(table, position, error);
}
FUSED void trilinear_errors(const trilinear_table* table, size_t count, const double* positions, double* errors) {
    for (size_t i = 0; i < count; ++i) interpolate(table, positions + 3 * i, errors + 3 * i);
}
