#include "diagnosis/slip_squares.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace stepdiag {
namespace {

constexpr std::ptrdiff_t six = BorderedBand::block_size;
constexpr std::ptrdiff_t lanes = widest_vector;  // sequences of one set-up, beside each other
constexpr int none = -1;

using Lanes = Eigen::Array<double, lanes, 1>;
using Columns = Eigen::Matrix<double, lanes, Eigen::Dynamic>;

std::ptrdiff_t round_up(std::ptrdiff_t n) { return (n + six - 1) / six * six; }

MatrixView columns(Columns& of, std::ptrdiff_t first = 0) { return {of.data() + lanes * first, lanes}; }
ConstMatrixView columns(const Columns& of, std::ptrdiff_t first = 0) { return {of.data() + lanes * first, lanes}; }

// The readings of one point.
struct Step {
    std::array<int, lanes> reading, place;  // of each sequence, into all readings and into the sequence; none
    int low = none, high = none;            // blocks; none where the point is at ends of travel
};

struct Part {
    int first, end;  // steps
    bool forward;    // added from the first one on; otherwise from the last one back
};

// What belongs to one set-up.
std::vector<Step> steps_of(const ReadingSequence* sequences, int count, const NormalEquations& equations) {
    const AdjustmentProblem& problem = equations.problem();
    std::map<std::size_t, Step> by_row;
    for (int lane = 0; lane < count; ++lane)
        for (int place = 0; place < int(sequences[lane].readings.size()); ++place) {
            const int r = sequences[lane].readings[place];
            const auto [at, is_new] = by_row.try_emplace(problem.readings()[r].row);
            Step& step = at->second;
            if (is_new) {
                step.reading.fill(none);
                for (const int node : equations.point(r).node)
                    if (const int block = problem.block_of(node); block != no_unknown) {
                        step.low = step.low == none ? block : std::min(step.low, block);
                        step.high = std::max(step.high, block);
                    }
            }
            step.reading[lane] = r;
            step.place[lane] = place;
        }
    std::vector<Step> steps;
    for (const auto& entry : by_row) steps.push_back(entry.second);
    return steps;
}

// The steps from one on that can be added in one order: what is touched by those before is coupled with each.
int end_of_part(const std::vector<Step>& steps, int first, const BorderedBand& matrix, bool forward) {
    int low = matrix.blocks() - 1, high = 0, end = first;
    for (; end < int(steps.size()); ++end) {
        const Step& step = steps[end];
        if (step.low == none) continue;
        if (forward ? high > matrix.reach(step.low) : step.high > matrix.reach(low)) break;
        low = std::min(low, step.low);
        high = std::max(high, step.high);
    }
    return end;
}

std::vector<Part> parts_of(const std::vector<Step>& steps, const BorderedBand& matrix) {
    std::vector<Part> parts;
    for (int first = 0; first < int(steps.size()); first = parts.back().end) {
        const int forward = end_of_part(steps, first, matrix, true), back = end_of_part(steps, first, matrix, false);
        parts.push_back({first, std::max(forward, back), forward > back});
    }
    return parts;
}

// The sum of readings of one set-up, and what N^-1 makes of it where it is needed.
class Sum {
public:
    Sum(const NormalEquations& equations, const BorderedFactor& factor, const BorderedBand& inverse, int setup)
        : equations_(equations),
          l_(factor.band()),
          z_(inverse),
          leaf_(z_.leaves() > 0 ? setup : none),
          first_leaf_(leaf_ == none ? 0 : z_.leaf_start(leaf_)),
          leaf_size_(leaf_ == none ? 0 : z_.leaf_size(leaf_)),
          band_step_(z_.blocks() > 0 ? z_.block(0, 0).outerStride() : 0),
          border_step_(z_.blocks() > 0 ? z_.border_rows(0).outerStride() : z_.border()),
          leaf_step_(leaf_ == none ? 0 : z_.leaf_column(1) - z_.leaf_column(0)),
          corner_(Eigen::MatrixXd::Zero(border_step_, round_up(z_.border()))),
          own_(Eigen::MatrixXd::Zero(leaf_size_, round_up(leaf_size_))) {
        rest_.setZero(lanes, six * z_.blocks());
        of_border_.setZero(lanes, round_up(z_.border()));
        of_leaf_.setZero(lanes, round_up(leaf_size_));
        border_ = of_border_;
        leaf_part_ = of_leaf_;
        corner_.topLeftCorner(z_.border(), z_.border()) = z_.corner();
        if (leaf_ != none) own_.leftCols(leaf_size_) = z_.leaf(leaf_);
    }

    // What belongs to blocks before this one is final. With leaves, which come before, nothing is.
    void finish_before(int block) {
        if (leaf_ != none) return;
        for (; first_ < std::min(block, last_ + 1); ++first_) {
            const int reach = l_.reach(first_);
            const auto diagonal = l_.block(first_, first_);
            const MatrixView own = columns(rest_, six * first_);
            divide_by_transpose(lanes, {diagonal.data(), band_step_}, own);
            if (reach > first_)
                subtract_product(lanes, six * (reach - first_), six, own,
                                 {l_.block(first_ + 1, first_).data(), 1, band_step_},
                                 columns(rest_, six * (first_ + 1)));
            subtract_product(lanes, round_up(z_.border()), six, own, {l_.border_rows(first_).data(), 1, border_step_},
                             columns(border_));
            last_ = std::max(last_, reach);
        }
        first_ = std::max(first_, block);
    }

    // Adds the readings of a step, each times its weight; these times N^-1 times the sum before.
    Lanes add(const Step& step, const Eigen::VectorXd& weight) {
        take(step, weight);
        Lanes product = Lanes::Zero();
        const auto meet = [&](const Run& run, const auto& other) {
            product -= (added_.middleCols(run.first, run.count).array() * other.array()).rowwise().sum();
        };
        for (const Run& run : runs_)
            if (run.where == Where::band) meet(run, times_inverse(int(run.place)));
            else meet(run, (run.where == Where::border ? of_border_ : of_leaf_).middleCols(run.place, run.count));
        for (const Run& run : runs_) add(run);
        return product;
    }

private:
    // Neighbouring unknowns of a point: of a block of the band, the border or the leaf.
    enum class Where { band, border, leaf };
    struct Run {
        Where where;
        std::ptrdiff_t first, count;  // of the point's unknowns
        std::ptrdiff_t place;         // the block; into the border; into the leaf
    };

    // The step's readings, negative as the kernels need them, and where they belong.
    void take(const Step& step, const Eigen::VectorXd& weight) {
        const int some = *std::max_element(step.reading.begin(), step.reading.end());
        const NormalEquations::Row any = equations_.row(some);
        added_.setZero(lanes, any.size);
        for (std::ptrdiff_t lane = 0; lane < lanes; ++lane)
            if (const int r = step.reading[lane]; r != none && weight[r] > 0.0)
                added_.row(lane) =
                    -weight[r] * Eigen::Map<const Eigen::RowVectorXd>(equations_.row(r).derivative, any.size);
        runs_.clear();
        const int banded = int(six) * z_.blocks();
        for (int i = 0; i < any.size; ++i) {
            const int unknown = any.unknown[i];
            if (unknown == no_unknown) continue;
            if (unknown < banded) {
                if (unknown % six == 0) runs_.push_back({Where::band, i, six, unknown / six});
                continue;
            }
            const int in_leaf = z_.leaf_place(unknown);
            const Where where = in_leaf >= 0 ? Where::leaf : Where::border;
            const std::ptrdiff_t place = in_leaf >= 0 ? in_leaf - first_leaf_ : z_.border_place(unknown);
            if (!runs_.empty() && runs_.back().where == where && runs_.back().place + runs_.back().count == place &&
                runs_.back().first + runs_.back().count == i)
                ++runs_.back().count;
            else runs_.push_back({where, i, 1, place});
        }
    }

    Eigen::Matrix<double, lanes, six> times_inverse(int block) const {  // rows of this block
        Eigen::Matrix<double, lanes, six> product = Eigen::Matrix<double, lanes, six>::Zero();
        const MatrixView to{product.data(), lanes};
        if (const int left = std::min(block, last_ + 1) - first_; left > 0)
            subtract_product(lanes, six, six * left, columns(rest_, six * first_),
                             {z_.block(block, first_).data(), 1, band_step_}, to);
        if (last_ >= block)
            subtract_product(lanes, six, six * (last_ + 1 - block), columns(rest_, six * block),
                             {z_.block(block, block).data(), band_step_, 1}, to);
        subtract_product(lanes, six, z_.border(), columns(border_), {z_.border_rows(block).data(), border_step_, 1},
                         to);
        if (leaf_ != none)
            subtract_product(lanes, six, leaf_size_, columns(leaf_part_), {leaf_row(six * block), 1, leaf_step_}, to);
        return product;
    }

    const double* leaf_row(std::ptrdiff_t row) const { return z_.leaf_column(first_leaf_) + row; }

    void add(const Run& run) {
        const auto own = added_.middleCols(run.first, run.count);
        const auto times = [&](RightFactor inverse, Columns& to) {
            subtract_product(lanes, to.cols(), run.count, columns(std::as_const(added_), run.first), inverse,
                             columns(to));
        };
        switch (run.where) {
            case Where::band:
                last_ = std::max(last_, int(run.place));
                rest_.middleCols(six * run.place, six) += own;
                times({z_.border_rows(int(run.place)).data(), 1, border_step_}, of_border_);
                if (leaf_ != none) times({leaf_row(six * run.place), leaf_step_, 1}, of_leaf_);
                break;
            case Where::border:
                border_.middleCols(run.place, run.count) += own;
                times({corner_.col(run.place).data(), 1, border_step_}, of_border_);
                if (leaf_ != none) times({leaf_row(z_.leaf_border() + run.place), leaf_step_, 1}, of_leaf_);
                break;
            case Where::leaf:
                leaf_part_.middleCols(run.place, run.count) += own;
                times({leaf_row(leaf_step_ * run.place + z_.leaf_border()), 1, leaf_step_}, of_border_);
                times({own_.col(run.place).data(), 1, own_.rows()}, of_leaf_);
                break;
        }
    }

    const NormalEquations& equations_;
    const BorderedBand &l_, &z_;
    int leaf_, first_leaf_;
    std::ptrdiff_t leaf_size_, band_step_, border_step_, leaf_step_;
    Eigen::MatrixXd corner_, own_;       // of the inverse: border and leaf, with zeros beyond
    int first_ = 0, last_ = none;        // blocks of the rest
    Columns rest_, border_, leaf_part_;  // negative: what is left of the sum
    Columns of_border_, of_leaf_;        // N^-1 times the sum
    Columns added_;
    std::vector<Run> runs_;
};

// The sequences of one set-up, up to `lanes` of them.
struct SetupSequences {
    const ReadingSequence* first;
    int count;
    std::vector<Step> steps;
    std::vector<Part> parts;
    // Of what each part begins from, A: A^T R A, by part; and A^T R times what each step adds.
    std::vector<Lanes> square, common;

    SetupSequences(const ReadingSequence* first, int count, const NormalEquations& equations,
                   const BorderedBand& matrix)
        : first(first),
          count(count),
          steps(steps_of(first, count, equations)),
          parts(parts_of(steps, matrix)),
          square(parts.size(), Lanes::Zero()),
          common(steps.size(), Lanes::Zero()) {}
};

// What a part begins from, of one sequence: all readings from a step on.
struct Start {
    SetupSequences* group;
    int part, lane, step;
};

void add_common(const std::vector<Start>& starts, const NormalEquations& equations, const BorderedFactor& factor,
                const Eigen::VectorXd& weight) {
    BorderedFactor::Sides sides;
    for (std::size_t begin = 0; begin < starts.size(); begin += BorderedFactor::sides) {
        const std::size_t end = std::min(starts.size(), begin + BorderedFactor::sides);
        sides.setZero(equations.problem().size(), BorderedFactor::sides);
        const auto each_reading = [&](std::size_t k, int first, const auto& use) {
            const std::vector<Step>& steps = starts[k].group->steps;
            for (int i = first; i < int(steps.size()); ++i)
                if (const int r = steps[i].reading[starts[k].lane]; r != none) use(i, r);
        };
        for (std::size_t k = begin; k < end; ++k)
            each_reading(k, starts[k].step,
                         [&](int, int r) { equations.row(r).add_to(sides.col(Eigen::Index(k - begin)), weight[r]); });
        factor.solve(sides);
        for (std::size_t k = begin; k < end; ++k) {
            const Start& start = starts[k];
            const Part& part = start.group->parts[start.part];
            const Eigen::VectorXd effect = sides.col(Eigen::Index(k - begin));
            each_reading(k, part.first, [&](int i, int r) {
                const bool own = i >= start.step;
                const double common = weight[r] * ((own ? weight[r] : 0.0) - equations.row(r).product(effect));
                if (own) start.group->square[start.part][start.lane] += common;
                if (i < part.end) start.group->common[i][start.lane] = common;
            });
        }
    }
}

// One part of a group, added step by step.
class Sweep {
public:
    Sweep(const SetupSequences& group, const Part& part, const NormalEquations& equations, const BorderedFactor& factor,
          const BorderedBand& inverse)
        : group_(&group),
          part_(part),
          square_of_start_(group.square[std::size_t(&part - group.parts.data())]),
          sum_(equations, factor, inverse, group.first->setup) {
        lowest_to_come_.resize(std::size_t(part.end - part.first));
        int low = none;
        for (int k = int(lowest_to_come_.size()); k-- > 0;) {
            const int own = step(k).low;
            if (own != none) low = low == none ? own : std::min(low, own);
            lowest_to_come_[k] = low;
        }
    }

    const SetupSequences& group() const { return *group_; }

    // Adds the steps that come before this block is final. `squares`: of the group's sequences.
    void go_to(int block, const Eigen::VectorXd& variances, const Eigen::VectorXd& weight,
               std::vector<double>* squares) {
        for (; next_ < int(lowest_to_come_.size()) && lowest_to_come_[next_] < block; ++next_) {
            const Step& step = this->step(next_);
            if (part_.forward) put(step, squares);
            if (lowest_to_come_[next_] != none) sum_.finish_before(lowest_to_come_[next_]);
            square_ -= 2.0 * sum_.add(step, weight);
            for (int lane = 0; lane < group_->count; ++lane)
                if (const int r = step.reading[lane]; r != none)
                    square_[lane] += weight[r] * weight[r] * (1.0 - variances[r]);
            common_ += group_->common[std::size_t(&step - group_->steps.data())];
            if (!part_.forward) put(step, squares);
        }
    }

private:
    const Step& step(int k) const { return group_->steps[part_.forward ? part_.first + k : part_.end - 1 - k]; }

    void put(const Step& step, std::vector<double>* squares) const {
        const Lanes square = square_of_start_ + square_ + (part_.forward ? -2.0 : 2.0) * common_;
        for (int lane = 0; lane < group_->count; ++lane)
            if (step.reading[lane] != none) squares[lane][step.place[lane]] = square[lane];
    }

    const SetupSequences* group_;
    Part part_;
    Lanes square_of_start_;                                  // A^T R A
    Lanes square_ = Lanes::Zero(), common_ = Lanes::Zero();  // h^T R h, A^T R h
    Sum sum_;
    std::vector<int> lowest_to_come_;  // block, of those that come with a step and after it
    int next_ = 0;
};

}  // namespace

std::vector<std::vector<double>> slip_squares(const std::vector<ReadingSequence>& sequences,
                                              const NormalEquations& equations, const BorderedFactor& factor,
                                              const BorderedBand& inverse, const Eigen::VectorXd& variances,
                                              const Eigen::VectorXd& weight) {
    std::vector<SetupSequences> groups;
    for (std::size_t s = 0, end; s < sequences.size(); s = end) {
        for (end = s; end < std::min(sequences.size(), s + lanes) && sequences[end].setup == sequences[s].setup;) ++end;
        groups.emplace_back(&sequences[s], int(end - s), equations, inverse);
    }
    std::vector<Start> starts;
    for (SetupSequences& group : groups)
        for (int p = 0; p < int(group.parts.size()); ++p) {
            const int step = group.parts[p].forward ? group.parts[p].first : group.parts[p].end;
            for (int lane = 0; lane < group.count && step < int(group.steps.size()); ++lane)
                starts.push_back({&group, p, lane, step});
        }
    add_common(starts, equations, factor, weight);

    std::vector<std::vector<double>> squares;
    for (const ReadingSequence& sequence : sequences) squares.emplace_back(sequence.readings.size());
    std::vector<std::pair<const SetupSequences*, const Part*>> parts;
    for (const SetupSequences& group : groups)
        for (const Part& part : group.parts) parts.emplace_back(&group, &part);
    // Some go along the band together, so that each of its blocks comes from memory once.
    constexpr std::size_t together = 16;
    constexpr int stride = 32;
    for (std::size_t first = 0; first < parts.size(); first += together) {
        std::vector<Sweep> sweeps;
        for (std::size_t i = first; i < std::min(parts.size(), first + together); ++i)
            sweeps.emplace_back(*parts[i].first, *parts[i].second, equations, factor, inverse);
        for (int block = 0; block < inverse.blocks() + stride; block += stride)
            for (Sweep& sweep : sweeps)
                sweep.go_to(block, variances, weight, squares.data() + (sweep.group().first - sequences.data()));
    }
    return squares;
}

}  // namespace stepdiag
