// From a linear map of readings to parameters: values, standard uncertainties, covariance. Internal.
//
// A map is applied to "rows": length, alpha and beta of each reading are each a row of numbers, with one number for
// each of several sets of readings. One set gives the values. A set that holds the effect of a single raw channel gives
// the share of that channel in every parameter. The shares make eq. 6: Cov(x) = sum over raw channels of share share^T.
// Rows of lanes evaluate many runs of one pattern (lane_maps.hpp).
#pragma once

#include <Eigen/Core>
#include <limits>
#include <numeric>
#include <vector>

#include "evaluation/fit_test.hpp"
#include "evaluation/linear_tape.hpp"
#include "evaluation/step_systems.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {

template <int Width>
using Row = Eigen::Array<double, Width, 1>;

constexpr std::size_t largest_covariance = 10'000;  // values; it has 800 MB
constexpr int values_per_reading = 3;               // length, alpha, beta

// Sets of readings to which a map is applied: a Row<Width> for each value. A map may skip the rest if only the readings
// of one pass, or no tilts, differ from zero.
template <class Number>
struct ReadingRows {
    std::vector<Number> values;  // values_per_reading for each reading
    int only_pass = -1;          // -1: all passes
    bool has_tilts = true;
};

// Parameters that a map gives: functions by index and node, then squarenesses.
struct ParameterLayout {
    int nodes;  // per axis
    int row(int function, int node) const { return function * nodes + node; }
    int row(Squareness squareness) const { return function_count * nodes + static_cast<int>(squareness); }
    int size() const { return function_count * nodes + squareness_count; }
};

// First elements of the three translations or rotations of an axis among the parameters.
template <class Number>
std::array<Number*, 3> functions_of(std::vector<Number>& parameters, const ParameterLayout& layout, Axis axis,
                                    Component first) {
    const auto begin = [&](int c) {
        return &parameters[layout.row(FunctionId{axis, Component(static_cast<int>(first) + c)}.index(), 0)];
    };
    return {begin(0), begin(1), begin(2)};
}

// Subtracts a straight line from a function: 0 at home, `end` at the last node.
template <class Number>
void take_off_trend(Number* function, int nodes, const Number& end) {
    for (int k = 1; k < nodes; ++k) {
        function[k] -= double(k) / (nodes - 1) * end;
    }
}

inline std::vector<Row<1>> readings_of(const std::vector<Pass>& passes) {
    std::vector<Row<1>> values;
    for (const Pass& pass : passes)
        for (const PassPoint& point : pass.points)
            for (int c = 0; c < values_per_reading; ++c) values.push_back(Row<1>(point.reading[c]));
    return values;
}

// One raw channel of one reading.
struct ChannelShare {
    int pass;
    int reading;
    ChannelEffect effect;
};

inline std::vector<ChannelShare> channel_shares(const std::vector<Pass>& passes) {
    // In each pass, channels without effect on tilts come first, so that whole blocks can skip the angles.
    std::vector<ChannelShare> shares;
    for (std::size_t v = 0; v < passes.size(); ++v)
        for (const bool tilts : {false, true})
            for (std::size_t k = 0; k < passes[v].points.size(); ++k)
                for (const ChannelEffect& effect : passes[v].points[k].effects)
                    if ((effect.tail<2>().cwiseAbs().maxCoeff() > 0.0) == tilts && effect.cwiseAbs().maxCoeff() > 0.0)
                        shares.push_back({int(v), passes[v].first_reading + int(k), effect});
    return shares;
}

// Calls `take(block, columns)` for the shares of successive raw channels; `block` has a row for each parameter.
template <int Width, class Map, class Take>
void for_each_share(const Map& map, const std::vector<Pass>& passes, Take&& take) {
    const auto shares = channel_shares(passes);
    ReadingRows<Row<Width>> readings;
    readings.values.assign(readings_of(passes).size(), Row<Width>::Zero());
    for (std::size_t begin = 0; begin < shares.size();) {
        std::size_t end = begin;
        readings.only_pass = shares[begin].pass;
        readings.has_tilts = false;
        for (; end < shares.size() && end - begin < Width && shares[end].pass == readings.only_pass; ++end) {
            for (int c = 0; c < values_per_reading; ++c)
                readings.values[values_per_reading * shares[end].reading + c][end - begin] = shares[end].effect[c];
            readings.has_tilts =
                readings.has_tilts || shares[end].effect.template tail<2>().cwiseAbs().maxCoeff() > 0.0;
        }
        take(map.template apply<Row<Width>>(readings), int(end - begin));
        for (std::size_t s = begin; s < end; ++s)
            for (int c = 0; c < values_per_reading; ++c)
                readings.values[values_per_reading * shares[s].reading + c].setZero();
        begin = end;
    }
}

// Shares one by one take the time of as many applications as there are channels, the tape's way that of as many as
// there are results, each of them several times as long.
inline bool is_tape_faster(const std::vector<Pass>& passes, std::size_t results) {
    constexpr std::size_t times = 4;
    std::size_t channels = 0;
    for (const Pass& pass : passes)
        for (const PassPoint& point : pass.points) channels += point.effects.size();
    return channels > times * results;
}

// A map on the tape: covariances of its results from those of the readings.
template <class Map>
class TapedMap {
public:
    TapedMap(const Map& map, const std::vector<Pass>& passes) : tape_(readings_of(passes).size()) {
        results_ = map.template apply<TapeNumber>({tape_.inputs(), -1, true});
        for (const Pass& pass : passes)
            for (const PassPoint& point : pass.points) {
                Eigen::Matrix3d& sum = of_readings_.emplace_back(Eigen::Matrix3d::Zero());
                for (const ChannelEffect& effect : point.effects) sum += effect * effect.transpose();
            }
    }

    // Variance of each result.
    std::vector<double> variances() const {
        std::vector<double> variances(results_.size(), 0.0);
        std::vector<Lanes> work;
        for (std::size_t first = 0; first < results_.size(); first += width) {
            const std::size_t end = std::min(first + width, results_.size());
            work.assign(tape_.size(), Lanes::Zero());
            for (std::size_t i = first; i < end; ++i)
                if (!is_zero(results_[i]))
                    work[std::size_t(results_[i].place)][Eigen::Index(i - first)] += results_[i].factor;
            tape_.backward(work);
            Lanes sum = Lanes::Zero();
            for (std::size_t r = 0; r < of_readings_.size(); ++r) {
                const Lanes* effect = &work[values_per_reading * r];
                for (int a = 0; a < values_per_reading; ++a)
                    for (int b = 0; b < values_per_reading; ++b) sum += of_readings_[r](a, b) * effect[a] * effect[b];
            }
            for (std::size_t i = first; i < end; ++i) variances[i] = std::max(0.0, sum[Eigen::Index(i - first)]);
        }
        return variances;
    }

    // Of these results: rows.size() x rows.size().
    Eigen::MatrixXd covariance(const std::vector<int>& rows) const {
        const std::size_t size = rows.size();
        Eigen::MatrixXd covariance(size, size);
        std::vector<Lanes> work;
        for (std::size_t first = 0; first < size; first += width) {
            const std::size_t end = std::min(first + width, size);
            work.assign(tape_.size(), Lanes::Zero());
            for (std::size_t i = first; i < end; ++i)
                if (const TapeNumber& result = results_[rows[i]]; !is_zero(result))
                    work[std::size_t(result.place)][Eigen::Index(i - first)] += result.factor;
            tape_.backward(work);
            for (std::size_t r = 0; r < of_readings_.size(); ++r) {
                Lanes* effect = &work[values_per_reading * r];
                const std::array<Lanes, values_per_reading> own{effect[0], effect[1], effect[2]};
                for (int a = 0; a < values_per_reading; ++a) {
                    effect[a].setZero();
                    for (int b = 0; b < values_per_reading; ++b) effect[a] += of_readings_[r](a, b) * own[b];
                }
            }
            tape_.forward(work);
            for (std::size_t i = 0; i < size; ++i) {
                const TapeNumber& result = results_[rows[i]];
                for (std::size_t j = first; j < end; ++j)
                    covariance(Eigen::Index(i), Eigen::Index(j)) =
                        is_zero(result) ? 0.0
                                        : result.factor * work[std::size_t(result.place)][Eigen::Index(j - first)];
            }
        }
        return 0.5 * (covariance + covariance.transpose());
    }

private:
    static constexpr std::size_t width = 8;
    using Lanes = Row<int(width)>;

    LinearTape tape_;
    std::vector<TapeNumber> results_;
    std::vector<Eigen::Matrix3d> of_readings_;
};

// Determined parameters, in the order of the tables.
template <class Map>
std::vector<int> determined_rows(const Map& map, const ParameterLayout& layout) {
    std::vector<int> rows;
    for (int i = 0; i < function_count; ++i)
        for (int k = 0; map.is_determined(FunctionId::at(i)) && k < layout.nodes; ++k) rows.push_back(layout.row(i, k));
    for (const Squareness s : all_squarenesses)
        if (map.is_determined(s)) rows.push_back(layout.row(s));
    return rows;
}

// Sets functions, squarenesses and covariance of the calibration, as far as `map.is_determined`.
template <class Map>
void evaluate_linear(const Map& map, const std::vector<Pass>& passes, const Plan& plan, bool full_covariance,
                     Calibration& calibration) {
    constexpr int width = 8;  // the rows of a step's sum then stay in registers
    const ParameterLayout layout{plan.steps() + 1};
    const std::vector<int> rows = determined_rows(map, layout);
    if (full_covariance && rows.size() > largest_covariance)
        throw InvalidArgument("full_covariance: expected at most " + std::to_string(largest_covariance) +
                              " values, the calibration has " + std::to_string(rows.size()));
    const auto values = map.template apply<Row<1>>({readings_of(passes), -1, true});
    std::vector<double> variance(layout.size(), 0.0);
    if (is_tape_faster(passes, std::size_t(layout.size()))) {
        const TapedMap<Map> taped(map, passes);
        variance = taped.variances();
        if (full_covariance) calibration.covariance = taped.covariance(rows);
    } else {
        std::vector<Row<width>> squares(layout.size(), Row<width>::Zero());
        Eigen::MatrixXd covariance;
        if (full_covariance) covariance = Eigen::MatrixXd::Zero(Eigen::Index(rows.size()), Eigen::Index(rows.size()));
        for_each_share<width>(map, passes, [&](const std::vector<Row<width>>& block, int columns) {
            for (std::size_t i = 0; i < block.size(); ++i) squares[i] += block[i].square();
            if (!full_covariance) return;
            Eigen::MatrixXd shares(rows.size(), columns);
            for (std::size_t i = 0; i < rows.size(); ++i)
                shares.row(Eigen::Index(i)) = block[rows[i]].head(columns).transpose();
            covariance.selfadjointView<Eigen::Lower>().rankUpdate(shares);
        });
        for (std::size_t i = 0; i < squares.size(); ++i) variance[i] = squares[i].sum();
        if (full_covariance) calibration.covariance = covariance.selfadjointView<Eigen::Lower>();
    }

    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        if (!map.is_determined(id)) continue;
        CalibratedFunction function{plan.nodes(id.axis), {}, {}, map.is_slope_determined(id)};
        for (int k = 0; k < layout.nodes; ++k) {
            function.value.push_back(values[layout.row(i, k)][0]);
            function.standard_uncertainty.push_back(std::sqrt(variance[layout.row(i, k)]));
        }
        calibration.functions[i] = std::move(function);
    }
    for (const Squareness s : all_squarenesses)
        if (map.is_determined(s))
            calibration.squarenesses[static_cast<int>(s)] =
                CalibratedSquareness{values[layout.row(s)][0], std::sqrt(variance[layout.row(s)])};
}

// Adds up the solved steps of one axis from home: component c goes to out[c][0] = 0 ... out[c][intervals]. With
// `only_pass`, the lengths of all other passes are known to be 0.
template <class Number>
void add_up_steps(const AxisSystem& system, const std::vector<Number>& lengths, const std::vector<Pass>& passes,
                  int only_pass, const std::array<Number*, 3>& out) {
    Number x = Number::Zero(), y = x, z = x;
    out[0][0] = out[1][0] = out[2][0] = x;
    for (std::size_t i = 0; i < system.intervals.size(); ++i) {
        const StepSystem& interval = system.intervals[i];
        if (interval.is_bridged) {
            for (const ReadingTerm& term : interval.bridge[0]) x += term.coefficient * lengths[term.reading];
            for (const ReadingTerm& term : interval.bridge[1]) y += term.coefficient * lengths[term.reading];
            for (const ReadingTerm& term : interval.bridge[2]) z += term.coefficient * lengths[term.reading];
        }
        for (std::size_t r = 0; !interval.is_bridged && r < interval.steps.size(); ++r) {
            const Step& step = interval.steps[r];
            if (only_pass >= 0 && only_pass != step.pass) continue;
            const Number* reading = &lengths[passes[step.pass].first_reading + step.point];
            const Number increment = step.sign * (reading[1] - reading[0]);
            const auto share = interval.solution->pseudoinverse.col(Eigen::Index(r));
            x += share[0] * increment;
            y += share[1] * increment;
            z += share[2] * increment;
        }
        out[0][i + 1] = x;
        out[1][i + 1] = y;
        out[2][i + 1] = z;
    }
}

// Selects every n-th contradiction; the others are not computed.
class Thinning {
public:
    explicit Thinning(std::size_t one_of) : one_of_(one_of) {}
    bool takes() { return seen_++ % one_of_ == 0; }
    std::size_t seen() const { return seen_; }

private:
    std::size_t one_of_, seen_ = 0;
};

// Sums of right-hand sides, with a row of coefficients for each. `right_sides` computes them, and is called only if one
// of the sums is selected. Most right-hand sides of a share are 0, and are skipped.
template <class Number, class RightSides>
void add_contradictions(const Contradictions& contradictions, const RightSides& right_sides, Thinning& thinning,
                        std::vector<Number>& out) {
    std::vector<Number> sides;
    std::vector<Eigen::Index> some;
    Eigen::VectorXd space;
    bool made = false;
    for (Eigen::Index i = 0; i < contradictions.rows(); ++i) {
        if (!thinning.takes()) continue;
        if (!made) {
            sides = right_sides();
            for (std::size_t j = 0; j < sides.size(); ++j)
                if (!is_zero(sides[j])) some.push_back(Eigen::Index(j));
            made = true;
        }
        const double* row = contradictions.row(i, space);
        Number sum = Number::Zero();
        for (const Eigen::Index j : some) sum += row[j] * sides[std::size_t(j)];
        out.push_back(sum);
    }
}

// Redundant readings of the steps of one axis: `channels` of the readings, one equation for each step.
template <class Number>
void add_contradictions(const AxisSystem& system, const std::vector<Number>& readings, const std::vector<int>& channels,
                        const std::vector<Pass>& passes, Thinning& thinning, std::vector<Number>& out) {
    for (const StepSystem& interval : system.intervals) {
        const auto increments = [&] {
            std::vector<Number> all;
            all.reserve(interval.steps.size() * channels.size());
            for (const Step& step : interval.steps)
                for (const int c : channels) {
                    const std::size_t from = values_per_reading * (passes[step.pass].first_reading + step.point) + c;
                    all.push_back(step.sign * (readings[from + values_per_reading] - readings[from]));
                }
            return all;
        };
        add_contradictions<Number>(interval.solution->contradictions, increments, thinning, out);
    }
}

// Gives the contradictions of a map in place of its parameters, thinned out.
template <class Map>
struct ContradictionsOf {
    const Map& map;
    std::size_t one_of = 1;

    template <class Number>
    std::vector<Number> apply(const ReadingRows<Number>& readings) const {
        Thinning thinning(one_of);
        return map.template contradictions<Number>(readings, thinning);
    }
};

// Tests whether the readings contradict each other: t^T Cov(t)^-1 t of the map's contradictions t is chi-square
// distributed, with the rank of Cov(t) as degrees of freedom. Sets fit and variance factor of the calibration. Cov(t)
// accounts for readings that neighbouring steps share. Of very many contradictions some hundreds are tested, at equal
// intervals.
template <class Map>
void test_fit(const Map& map, const std::vector<Pass>& passes, Calibration& calibration) {
    constexpr int width = 8;
    constexpr std::size_t most = 400;
    const ReadingRows<Row<1>> readings{readings_of(passes), -1, true};
    ContradictionsOf<Map> contradictions{map};
    Thinning counted(std::numeric_limits<std::size_t>::max());
    map.template contradictions<Row<1>>(readings, counted);
    const std::size_t count = counted.seen();
    contradictions.one_of = std::max<std::size_t>(1, (count + most - 1) / most);
    const auto found = contradictions.template apply<Row<1>>(readings);
    Eigen::VectorXd values(found.size());
    for (std::size_t i = 0; i < found.size(); ++i) values[Eigen::Index(i)] = found[i][0];
    Eigen::MatrixXd all;
    if (is_tape_faster(passes, found.size())) {
        std::vector<int> rows(found.size());
        std::iota(rows.begin(), rows.end(), 0);
        all = TapedMap<ContradictionsOf<Map>>(contradictions, passes).covariance(rows);
    } else {
        ShareSum covariance(values.size());
        for_each_share<width>(contradictions, passes, [&](const std::vector<Row<width>>& block, int columns) {
            for (int c = 0; c < columns; ++c) covariance.add([&](std::size_t i) { return block[i][c]; });
        });
        all = covariance.matrix();
    }
    const ChiSquare test = chi_square(values, all);
    calibration.fit = fit_of_noise(test.square_sum, test.freedom);
    if (test.freedom > 0) calibration.variance_factor = test.square_sum / test.freedom;
}

}  // namespace stepdiag
