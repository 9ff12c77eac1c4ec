#include "batch/simd_solver.hpp"

#include <algorithm>

#include "core/simd_targets.hpp"
#include "stepdiag/core/random_blocks.hpp"
#define HWY_TARGET_INCLUDE "batch/simd_solver.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

constexpr int six = BorderedBand::block_size;

STEPDIAG_INLINE std::size_t pair_lanes() { return 2 * hn::Lanes(Tag()); }

template <int Rows>
STEPDIAG_INLINE void add_transposed_bundle(const SimdJacobian::Numbers& jacobian, const SimdJacobian::Bundle& bundle,
                                           const double* readings, const double* others, double* unknowns) {
    Pair force[Rows];
    for (int i = 0; i < Rows; ++i) {
        const std::size_t place = lane_group * std::size_t(bundle.first_reading + i);
        force[i] = load(readings + place) - load(others + place);
    }
    const double* derivative = jacobian.derivative.data() + bundle.first_derivative;
    const int* unknown = jacobian.unknown.data() + bundle.first_unknown;
    for (int k = 0; k < bundle.unknowns; ++k, derivative += Rows) {
        double* to = unknowns + lane_group * std::size_t(unknown[k]);
        Pair sum = load(to);
        for (int i = 0; i < Rows; ++i) sum = mul_add(all(derivative[i]), force[i], sum);
        store(sum, to);
    }
}

template <int Rows>
STEPDIAG_INLINE void subtract_bundle(const SimdJacobian::Numbers& jacobian, const SimdJacobian::Bundle& bundle,
                                     const double* readings, const double* unknowns, double* result) {
    const std::size_t first = lane_group * std::size_t(bundle.first_reading);
    Pair rest[Rows];
    for (int i = 0; i < Rows; ++i) rest[i] = load(readings + first + lane_group * std::size_t(i));
    const double* derivative = jacobian.derivative.data() + bundle.first_derivative;
    const int* unknown = jacobian.unknown.data() + bundle.first_unknown;
    for (int k = 0; k < bundle.unknowns; ++k, derivative += Rows) {
        const Pair x = load(unknowns + lane_group * std::size_t(unknown[k]));
        for (int i = 0; i < Rows; ++i) rest[i] = sub_mul(all(derivative[i]), x, rest[i]);
    }
    for (int i = 0; i < Rows; ++i) store(rest[i], result + first + lane_group * std::size_t(i));
}

void add_transposed_difference(const SimdJacobian::Numbers& jacobian, const double* readings, const double* others,
                               double* unknowns) {
    for (std::size_t lane = 0; lane < lane_group; lane += pair_lanes())
        for (const SimdJacobian::Bundle& bundle : jacobian.bundles) {
            const double *a = readings + lane, *b = others + lane;
            double* to = unknowns + lane;
            if (bundle.rows == 3) add_transposed_bundle<3>(jacobian, bundle, a, b, to);
            else if (bundle.rows == 2) add_transposed_bundle<2>(jacobian, bundle, a, b, to);
            else add_transposed_bundle<1>(jacobian, bundle, a, b, to);
        }
}

void subtract_product(const SimdJacobian::Numbers& jacobian, const double* readings, const double* unknowns,
                      double* result) {
    for (std::size_t lane = 0; lane < lane_group; lane += pair_lanes())
        for (const SimdJacobian::Bundle& bundle : jacobian.bundles) {
            const double *from = readings + lane, *x = unknowns + lane;
            double* to = result + lane;
            if (bundle.rows == 3) subtract_bundle<3>(jacobian, bundle, from, x, to);
            else if (bundle.rows == 2) subtract_bundle<2>(jacobian, bundle, from, x, to);
            else subtract_bundle<1>(jacobian, bundle, from, x, to);
        }
}

// Rows of L below the diagonal block of one block column: y -= L x.
STEPDIAG_INLINE const double* eliminate(const double* l, int rows, const Pair (&own)[six], double* y) {
    for (int i = 0; i < rows; ++i, l += six, y += lane_group) {
        Pair sum = load(y);
        for (int k = 0; k < six; ++k) sum = sub_mul(all(l[k]), own[k], sum);
        store(sum, y);
    }
    return l;
}

// x -= L^T y
STEPDIAG_INLINE const double* collect(const double* l, int rows, const double* y, Pair (&own)[six]) {
    for (int i = 0; i < rows; ++i, l += six, y += lane_group) {
        const Pair from = load(y);
        for (int k = 0; k < six; ++k) own[k] = sub_mul(all(l[k]), from, own[k]);
    }
    return l;
}

void solve_corner(const SimdFactor::Numbers& factor, double* border) {
    const int rank = int(factor.corner_order.size());
    std::vector<double> numbers(2 * lane_group * std::size_t(rank));  // room for a pair of the widest vectors each
    const std::size_t width = pair_lanes();
    const auto at = [&](int i) HWY_ATTR { return numbers.data() + width * std::size_t(i); };
    const auto l = [&](int i, int k) { return factor.corner[std::size_t(k) * rank + i]; };
    for (int i = 0; i < rank; ++i) store(load(border + lane_group * std::size_t(factor.corner_order[i])), at(i));
    const auto step = [&](int k, int from, int to, bool transposed) HWY_ATTR {
        Pair own = load(at(k));
        own = all(l(k, k)) * own;
        store(own, at(k));
        for (int i = from; i < to; ++i) {
            Pair sum = load(at(i));
            sum = sub_mul(all(transposed ? l(k, i) : l(i, k)), own, sum);
            store(sum, at(i));
        }
    };
    for (int k = 0; k < rank; ++k) step(k, k + 1, rank, false);
    for (int k = rank; k-- > 0;) step(k, 0, k, true);
    for (int i = 0; i < factor.border; ++i) store(all(0.0), border + lane_group * std::size_t(i));
    for (int i = 0; i < rank; ++i) store(load(at(i)), border + lane_group * std::size_t(factor.corner_order[i]));
}

void solve_pair(const SimdFactor::Numbers& factor, double* x) {
    const int blocks = int(factor.rows.size());
    const auto block = [&](int column) { return x + lane_group * std::size_t(six * column); };
    double* border = block(blocks);
    const double* l = factor.column.data();
    Pair own[six];
    for (int column = 0; column < blocks; ++column) {
        double* at = block(column);
        for (int i = 0; i < six; ++i) {
            own[i] = load(at + lane_group * std::size_t(i));
            for (int k = 0; k < i; ++k) own[i] = sub_mul(all(l[six * i + k]), own[k], own[i]);
            own[i] = all(l[six * i + i]) * own[i];
            store(own[i], at + lane_group * std::size_t(i));
        }
        l = eliminate(l + six * six, factor.rows[column], own, block(column + 1));
        l = eliminate(l, factor.border, own, border);
    }
    solve_corner(factor, border);
    for (int column = blocks; column-- > 0;) {
        double* at = block(column);
        l -= six * (six + factor.rows[column] + factor.border);
        for (int i = 0; i < six; ++i) own[i] = load(at + lane_group * std::size_t(i));
        collect(collect(l + six * six, factor.rows[column], block(column + 1), own), factor.border, border, own);
        for (int i = six; i-- > 0;) {
            for (int k = i + 1; k < six; ++k) own[i] = sub_mul(all(l[six * k + i]), own[k], own[i]);
            own[i] = all(l[six * i + i]) * own[i];
            store(own[i], at + lane_group * std::size_t(i));
        }
    }
}

void solve(const SimdFactor::Numbers& factor, double* x) {
    for (std::size_t lane = 0; lane < lane_group; lane += pair_lanes()) solve_pair(factor, x + lane);
}

void find_largest(const std::vector<LinearForm>& forms, const std::vector<double>& factor, const double* unknowns,
                  double* largest) {
    for (std::size_t lane = 0; lane < lane_group; lane += pair_lanes()) {
        Pair most = all(0.0);
        for (std::size_t e = 0; e < forms.size(); ++e) {
            Pair value = all(0.0);
            for (int k = 0; k < forms[e].size; ++k) {
                const double* from = unknowns + lane_group * std::size_t(forms[e].unknown[k]) + lane;
                value = mul_add(all(forms[e].coefficient[k]), load(from), value);
            }
            const Pair size = magnitude(value) * all(factor[e]);
            most = select(either(size > most, no(size <= size)), size, most);
        }
        store(most, largest + lane);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(add_transposed_difference);
HWY_EXPORT(subtract_product);
HWY_EXPORT(solve);
HWY_EXPORT(find_largest);

}  // namespace

SimdJacobian::SimdJacobian(const NormalEquations& equations) {
    for (const AdjustedPoint& point : equations.problem().points())
        for (int first = point.first_reading; first < point.end_reading; first += most_rows) {
            const int rows = std::min(most_rows, point.end_reading - first);
            Bundle bundle{first, rows, 0, numbers_.unknown.size(), numbers_.derivative.size()};
            const auto common = equations.row(point, first);
            for (int k = 0; k < common.size; ++k) {
                if (common.unknown[k] == no_unknown) continue;
                numbers_.unknown.push_back(common.unknown[k]);
                for (int i = 0; i < rows; ++i)
                    numbers_.derivative.push_back(equations.row(point, first + i).derivative[k]);
                ++bundle.unknowns;
            }
            numbers_.bundles.push_back(bundle);
        }
}

SimdFactor::SimdFactor(const BorderedFactor& factor) {
    constexpr int six = BorderedBand::block_size;
    const BorderedBand& l = factor.band();
    numbers_.border = l.border();
    for (int column = 0; column < l.blocks(); ++column) {
        numbers_.rows.push_back(six * (l.reach(column) - column));
        for (int row = column; row <= l.reach(column); ++row)
            for (int i = 0; i < six; ++i)
                for (int k = 0; k < six; ++k) numbers_.column.push_back(l.block(row, column)(i, k));
        for (int i = 0; i < l.border(); ++i)
            for (int k = 0; k < six; ++k) numbers_.column.push_back(l.border_rows(column)(i, k));
    }
    const auto corner = factor.corner_factor();
    numbers_.corner_order.assign(factor.corner_order().begin(), factor.corner_order().begin() + corner.cols());
    for (int k = 0; k < corner.cols(); ++k)
        for (int i = 0; i < corner.rows(); ++i) numbers_.corner.push_back(i == k ? 1.0 / corner(i, k) : corner(i, k));
}

void SimdJacobian::add_transposed_difference(const double* readings, const double* others, double* unknowns) const {
    HWY_DYNAMIC_DISPATCH(add_transposed_difference)(numbers_, readings, others, unknowns);
}

void SimdJacobian::subtract_product(const double* readings, const double* unknowns, double* result) const {
    HWY_DYNAMIC_DISPATCH(subtract_product)(numbers_, readings, unknowns, result);
}

void SimdFactor::solve(double* right_hand_side) const { HWY_DYNAMIC_DISPATCH(solve)(numbers_, right_hand_side); }

void find_largest(const std::vector<LinearForm>& forms, const std::vector<double>& factor, const double* unknowns,
                  double* largest) {
    HWY_DYNAMIC_DISPATCH(find_largest)(forms, factor, unknowns, largest);
}

}  // namespace stepdiag
#endif  // HWY_ONCE
