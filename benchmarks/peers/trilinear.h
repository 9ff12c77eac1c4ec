/* The error vector by interpolation in a table of space: what a controller's programmer writes first. */
#pragma once

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Errors at n * n * n nodes from 0 to the end of each axis, mm: rows x, y, z; z changes fastest. */
typedef struct {
    int n;
    double nodes_per_mm[3];
    const double* errors;
} trilinear_table;

void trilinear_error(const trilinear_table* table, const double position[3], double error[3]);
void trilinear_errors(const trilinear_table* table, size_t count, const double* positions, double* errors);

#ifdef __cplusplus
}
#endif
