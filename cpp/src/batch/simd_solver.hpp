// Linear algebra of the adjustment for many right-hand sides at once, one in each lane (simd_model.hpp), with
// derivatives and factor of one place. Internal: not installed.
#pragma once

#include <vector>

#include "adjustment/adjustment_tables.hpp"
#include "adjustment/normal_equations.hpp"

namespace stepdiag {

// J, the derivatives of all weighted readings.
class SimdJacobian {
public:
    explicit SimdJacobian(const NormalEquations& equations);

    // unknowns += J^T (readings - others)
    void add_transposed_difference(const double* readings, const double* others, double* unknowns) const;
    // result = readings - J unknowns
    void subtract_product(const double* readings, const double* unknowns, double* result) const;

    // Up to three readings of a point, which share their unknowns.
    static constexpr int most_rows = 3;
    struct Bundle {
        int first_reading, rows;
        int unknowns;
        std::size_t first_unknown;     // into `unknown`
        std::size_t first_derivative;  // into `derivative`, by unknown and row
    };
    struct Numbers {
        std::vector<Bundle> bundles;
        std::vector<int> unknown;
        std::vector<double> derivative;
    };

private:
    Numbers numbers_;
};

// L of N = L L^T, stored in the order of its use.
class SimdFactor {
public:
    explicit SimdFactor(const BorderedFactor& factor);

    void solve(double* right_hand_side) const;  // in place; fixed unknowns are 0

    struct Numbers {
        std::vector<int> rows;  // of the band, below each diagonal block
        std::vector<double>
            column;  // for each block column: diagonal block, rows below, rows of the border; row by row
        int border;
        std::vector<int> corner_order;
        std::vector<double> corner;  // column by column, with the reciprocals of the pivots
    };

private:
    Numbers numbers_;
};

// The largest of |form(unknowns)| factor in each lane; NaN if any is NaN.
void find_largest(const std::vector<LinearForm>& forms, const std::vector<double>& factor, const double* unknowns,
                  double* largest);

}  // namespace stepdiag
