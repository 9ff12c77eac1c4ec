// A linear map written down as it is applied once: sums of two numbers each. Run backwards, it tells what every reading
// does to some of the results, in the time of one application; run forwards, what the results become. So the covariance
// of results takes a time proportional to readings times results, where shares one by one (for_each_share) take that of
// readings times readings. Internal.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace stepdiag {

class LinearTape;

// A number of the map: factor times what the tape has at `place`. Takes the place of a Row.
struct TapeNumber {
    static constexpr int zero = -1;
    int place = zero;
    double factor = 0.0;
    LinearTape* tape = nullptr;

    static TapeNumber Zero() { return {}; }
    TapeNumber& operator+=(const TapeNumber& other);
    TapeNumber& operator-=(const TapeNumber& other) {
        return *this += TapeNumber{other.place, -other.factor, other.tape};
    }
    friend TapeNumber operator+(TapeNumber a, const TapeNumber& b) { return a += b; }
    friend TapeNumber operator-(TapeNumber a, const TapeNumber& b) { return a -= b; }
    friend TapeNumber operator*(double factor, TapeNumber a) {
        if (factor == 0.0) return Zero();
        a.factor *= factor;
        return a;
    }
    friend TapeNumber operator/(const TapeNumber& a, double divisor) { return 1.0 / divisor * a; }
};

inline bool is_zero(const TapeNumber& number) { return number.place == TapeNumber::zero; }
template <int Width>
bool is_zero(const Eigen::Array<double, Width, 1>& number) {
    return (number == 0.0).all();
}

class LinearTape {
public:
    explicit LinearTape(std::size_t inputs) : inputs_(inputs) {}
    LinearTape(const LinearTape&) = delete;

    std::vector<TapeNumber> inputs() {
        std::vector<TapeNumber> all(inputs_);
        for (std::size_t i = 0; i < inputs_; ++i) all[i] = {int(i), 1.0, this};
        return all;
    }
    TapeNumber sum(const TapeNumber& a, const TapeNumber& b) {
        sums_.push_back({a.place, b.place, a.factor, b.factor});
        return {int(inputs_ + sums_.size()) - 1, 1.0, this};
    }
    std::size_t size() const { return inputs_ + sums_.size(); }

    // What all places do to the results that stand in `effect` at their own, by lane.
    template <class Lanes>
    void backward(std::vector<Lanes>& effect) const {
        for (std::size_t k = sums_.size(); k-- > 0;) {
            const Lanes own = effect[inputs_ + k];
            if ((own == 0.0).all()) continue;
            const Sum& sum = sums_[k];
            effect[std::size_t(sum.a)] += sum.factor_a * own;
            effect[std::size_t(sum.b)] += sum.factor_b * own;
        }
    }
    // The values of all places from those of the inputs.
    template <class Lanes>
    void forward(std::vector<Lanes>& value) const {
        for (std::size_t k = 0; k < sums_.size(); ++k) {
            const Sum& sum = sums_[k];
            value[inputs_ + k] = sum.factor_a * value[std::size_t(sum.a)] + sum.factor_b * value[std::size_t(sum.b)];
        }
    }

private:
    struct Sum {
        int a, b;
        double factor_a, factor_b;
    };
    std::size_t inputs_;
    std::vector<Sum> sums_;
};

inline TapeNumber& TapeNumber::operator+=(const TapeNumber& other) {
    if (is_zero(other)) return *this;
    return *this = is_zero(*this) ? other : other.tape->sum(*this, other);
}

}  // namespace stepdiag
