// Tests for faults of the readings, at the solution of an adjustment and without another one. Internal: not installed.
// A fault of size f adds f to some readings: f c to the weighted residuals w, c being 1/u at each of these. To first
// order an adjustment with f as one more unknown finds
//   f = s/q, u(f) = 1/sqrt(q), s = c.w, q = c.c - (J^T c)^T N^-1 (J^T c), N = J^T J + P,
// and chi-square becomes less by s^2/q, the square of W. Baarda's test (1968) where c is a single reading. Two faults
// are distinguished as far as their correlation differs from 1, rho = c^T R d/sqrt(q_c q_d), R = I - J N^-1 J^T.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "diagnosis/slip_squares.hpp"

namespace stepdiag {

struct FaultHypothesis {
    FaultKind kind;
    int sequence;
    int first;  // into its sequence: the reading, that from which on the channel slipped, or 0

    bool operator==(const FaultHypothesis& other) const {
        return kind == other.kind && sequence == other.sequence && first == other.first;
    }
};

// Every fault that is tested for, each once. The slip before the last reading is that reading's fault. Where an unknown
// of the set-up takes up a constant of the channel, the slip after the first reading is the opposite of that reading's
// fault (`as_slip`), and of two readings there is only one fault. A factor is one of a line's only distance. Readings
// that are left out take no part: make it anew after leaving one out.
class FaultHypotheses {
public:
    explicit FaultHypotheses(const AdjustmentProblem& problem);

    // Of all readings, left out or not, so that the numbers of sequences and places in them stay.
    const std::vector<ReadingSequence>& sequences() const { return sequences_; }
    const std::vector<FaultHypothesis>& all() const { return all_; }

    struct Readings {
        const int *first, *last;

        const int* begin() const { return first; }
        const int* end() const { return last; }
    };
    Readings readings(const FaultHypothesis& hypothesis) const;
    // What one of its readings reads too much by a fault of size 1.
    double share(const FaultHypothesis& hypothesis, int reading) const {
        return hypothesis.kind == FaultKind::factor ? part_of_travel_[reading] : 1.0;
    }
    ReadingPattern pattern(const FaultHypothesis& hypothesis) const;

    // A wrong first reading, named as a slip of all later ones by as much the other way; none for other faults.
    std::optional<FaultHypothesis> as_slip(const FaultHypothesis& reading) const;
    // The one that is tested in its place: of a slip that as_slip gives, the reading; of others themselves.
    FaultHypothesis as_tested(const FaultHypothesis& hypothesis) const;
    // Whether a fault and the slip that it may be named as differ at second order: a mirror's angle, which takes up the
    // constant of a tilt, acts on distances too.
    bool differs_from_slip(const FaultHypothesis& reading) const;

private:
    std::vector<ReadingSequence> sequences_;
    std::vector<std::array<int, 2>> first_;  // two used places of each sequence that has a free constant
    std::vector<bool> is_tilt_;
    std::vector<double> part_of_travel_;  // by reading: of the farthest one of its set-up
    std::vector<FaultHypothesis> all_;
};

struct FaultScore {
    double size = 0.0;                  // mm or rad
    double standard_uncertainty = 0.0;  // of the size; infinite where nothing controls it
    double gain = 0.0;                  // in chi-square; 0 where nothing controls it

    FaultScore() = default;
    FaultScore(double s, double q);  // s = c.w and q; 0 where nothing controls it
};

// Of any faults, at the equations' last linearisation, with the factor there: half a solution each. Below this share of
// c.c, q is what rounding and second order leave.
std::vector<FaultScore> scores_of(const std::vector<const ReadingPattern*>& patterns, const NormalEquations& equations,
                                  const BorderedFactor& factor, double least_share);

// Of readings scores cost nothing, because the inverse is there; of slips a little (slip_squares.hpp); of a factor half
// a solution, and so of all where the inverse loses digits.
class FaultTests {
public:
    // At the equations' last linearisation. `factor`: of N there; `inverse`: its inverse; `variances`: of the readings,
    // from it. The equations, the factor and the hypotheses must outlive this.
    FaultTests(const NormalEquations& equations, const BorderedFactor& factor, const BorderedBand& inverse,
               const Eigen::VectorXd& variances, const FaultHypotheses& hypotheses)
        : FaultTests(equations, factor, inverse, variances, hypotheses, equations.residuals()) {}
    // The same somewhere else than at the minimum. `residuals`: weighted, at the minimum of that linear problem.
    FaultTests(const NormalEquations& equations, const BorderedFactor& factor, const BorderedBand& inverse,
               const Eigen::VectorXd& variances, const FaultHypotheses& hypotheses, const Eigen::VectorXd& residuals);

    const FaultHypotheses& hypotheses() const { return *hypotheses_; }
    const std::vector<FaultScore>& scores() const { return scores_; }  // by hypothesis

    double square(int hypothesis) const { return square_[hypothesis]; }  // c.c
    // What a fault of size 1 that is not accounted for does to all unknowns: N^-1 J^T c.
    Eigen::VectorXd effect(const FaultHypothesis& hypothesis) const;
    Eigen::VectorXd effect(int hypothesis) const { return effect(hypotheses_->all()[hypothesis]); }
    // Of up to BorderedFactor::sides hypotheses, beside each other; all others are 0.
    BorderedFactor::Sides effects(const int* hypotheses, int count) const;
    // What each fault of size 1 does to values: `use(hypothesis, OfSides)`. `y`: N^-1 of their forms.
    template <class Use>
    void each_effect(const BorderedFactor::Sides& y, const Use& use) const;
    // Of up to BorderedFactor::sides hypotheses that have these effects with each one: `use(hypothesis, OfSides)`; 0
    // where nothing controls one of the two.
    template <class Use>
    void each_correlation(const int* hypotheses, int count, const BorderedFactor::Sides& effects, const Use& use) const;
    std::vector<double> correlations(int hypothesis) const;  // of one with each
    double correlation(int h, int k) const { return correlations(h)[k]; }

private:
    double weight(const FaultHypothesis& hypothesis, int reading) const {  // element of c
        return weight_[reading] * hypotheses_->share(hypothesis, reading);
    }
    void add_gradient(const FaultHypothesis& hypothesis, NormalEquations::Side gradient) const;  // J^T c
    BorderedFactor::Sides gradients(const int* hypotheses, int count) const;
    void sum_readings();
    // c of each hypothesis times what is shown by the readings, a row each: `use(hypothesis, OfSides)`.
    template <class Use>
    void each_product(const BorderedFactor::Sides& shown, const Use& use) const;
    bool are_exact(std::vector<int> hypotheses, const std::vector<double>& found);
    void solve_for(const std::vector<int>& hypotheses);
    void set(int hypothesis, double c_r_c);

    const NormalEquations* equations_;
    const BorderedFactor* factor_;
    const FaultHypotheses* hypotheses_;
    Eigen::VectorXd residuals_;
    Eigen::VectorXd weight_;                // by reading: 1/u, 0 where it is left out
    std::vector<double> square_, product_;  // c.c and c.w, by hypothesis
    std::vector<double> c_r_c_;             // q, by hypothesis; 0 where nothing controls it
    std::vector<FaultScore> scores_;
};

template <class Use>
void FaultTests::each_effect(const BorderedFactor::Sides& y, const Use& use) const {
    each_product(equations_->images(y), use);
}

template <class Use>
void FaultTests::each_correlation(const int* hypotheses, int count, const BorderedFactor::Sides& effects,
                                  const Use& use) const {
    using OfSides = BorderedFactor::OfSides;
    BorderedFactor::Sides shown = -equations_->images(effects);  // R c
    OfSides scale = OfSides::Zero();
    for (int k = 0; k < count; ++k) {
        const FaultHypothesis& h = hypotheses_->all()[hypotheses[k]];
        for (const int r : hypotheses_->readings(h)) shown(r, k) += weight(h, r);
        if (c_r_c_[hypotheses[k]] > 0.0) scale[k] = 1.0 / std::sqrt(c_r_c_[hypotheses[k]]);
    }
    each_product(shown, [&](int h, const OfSides& product) {
        const double own = c_r_c_[h] > 0.0 ? 1.0 / std::sqrt(c_r_c_[h]) : 0.0;
        use(h, OfSides(own * product.cwiseProduct(scale)));
    });
}

template <class Use>
void FaultTests::each_product(const BorderedFactor::Sides& shown, const Use& use) const {
    using OfSides = BorderedFactor::OfSides;
    const std::vector<FaultHypothesis>& all = hypotheses_->all();
    std::vector<OfSides> from;  // of a sequence from each place to its end
    for (std::size_t h = 0; h < all.size();) {
        const int sequence = all[h].sequence;
        const std::vector<int>& readings = hypotheses_->sequences()[sequence].readings;
        from.assign(readings.size() + 1, OfSides::Zero());
        for (std::size_t i = readings.size(); i-- > 0;)
            from[i].noalias() = from[i + 1] + weight_[readings[i]] * shown.row(readings[i]);
        for (; h < all.size() && all[h].sequence == sequence; ++h) {
            OfSides product = OfSides::Zero();
            if (all[h].kind == FaultKind::slip) product = from[all[h].first];
            else
                for (const int r : hypotheses_->readings(all[h])) product += weight(all[h], r) * shown.row(r);
            use(int(h), product);
        }
    }
}

}  // namespace stepdiag
