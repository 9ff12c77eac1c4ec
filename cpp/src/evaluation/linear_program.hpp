// A linear map as a flat list of sparse rows, each a weighted sum of inputs and of rows before it; run for many sets of
// inputs at once, a set a lane. The evaluation's own arithmetic writes it down: see Traced. Internal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stepdiag {

// Vectors of these many sets: registers[place * program_lanes + lane].
inline constexpr std::size_t program_lanes = 16;

class LinearProgram {
public:
    struct Term {
        int place;
        double coefficient;
    };

    std::size_t inputs() const { return inputs_; }
    std::size_t outputs() const { return outputs_; }
    std::size_t registers() const { return registers_; }
    std::size_t multiplications() const { return coefficients_.size(); }

    // Inputs stand in the first places of `registers`, all of which are written to. Results go to
    // values[output * stride + lane].
    void run(double* registers, double* values, std::size_t stride) const;

    // --- for the code that runs it
    // Up to three rows that are sums over the same places, sum over terms + `base`. Of differences, a term is
    // coefficient (place - other place).
    struct Shape {
        std::uint32_t rows;
        std::uint32_t terms;
        bool of_differences;

        bool operator==(const Shape& o) const {
            return rows == o.rows && terms == o.terms && of_differences == o.of_differences;
        }
    };
    struct Blocks {  // one after the other
        Shape shape;
        std::uint32_t count;
    };
    struct Row {
        std::int32_t base;    // a place; that of the zero, where there is none
        std::int32_t to;      // a place; -1: no later row needs it
        std::int32_t output;  // -1: none
    };
    static constexpr std::uint32_t most_rows = 3;

    const std::vector<Blocks>& blocks() const { return blocks_; }
    const Row* rows() const { return rows_.data(); }
    const std::uint32_t* places() const { return places_.data(); }       // by term, of differences two
    const double* coefficients() const { return coefficients_.data(); }  // by term, then by row
    std::size_t zero() const { return inputs_; }

private:
    friend class ProgramBuilder;  // and its Emitter
    std::size_t inputs_ = 0, outputs_ = 0, registers_ = 0;
    std::vector<Blocks> blocks_;
    std::vector<Row> rows_;
    std::vector<std::uint32_t> places_;
    std::vector<double> coefficients_;
};

class ProgramBuilder {
public:
    explicit ProgramBuilder(std::size_t inputs) : inputs_(inputs) {}

    std::size_t inputs() const { return inputs_; }
    // The place of a new row. Terms of one place are added up.
    int add(std::vector<LinearProgram::Term> terms);
    // What rows the outputs do not need is left out. An output is a place, or -1 for 0.
    LinearProgram build(const std::vector<int>& outputs) const;

private:
    struct Sum {
        int base;  // place with coefficient 1, taken out of the terms; -1: none
        std::vector<LinearProgram::Term> terms;
    };
    struct Block;
    class Emitter;
    std::vector<bool> needed_places(const std::vector<int>& outputs) const;
    std::vector<Block> make_blocks(const std::vector<bool>& needed) const;
    void order_by_shape(std::vector<Block>& blocks) const;

    std::size_t inputs_;
    std::vector<Sum> sums_;
};

// A number that remembers how it came about from a program's inputs: a weighted sum of places. What computes with
// Row<Width> computes with it as well; settle() makes it a row of its own.
class Traced {
public:
    Traced() = default;
    Traced(ProgramBuilder& builder, int place) : builder_(&builder), terms_{{place, 1.0}} {}
    static Traced Zero() { return {}; }

    Traced& operator+=(const Traced& other) { return add(1.0, other); }
    Traced& operator-=(const Traced& other) { return add(-1.0, other); }
    friend Traced operator+(Traced a, const Traced& b) { return a += b; }
    friend Traced operator-(Traced a, const Traced& b) { return a -= b; }
    friend Traced operator*(double factor, const Traced& a) { return Traced().add(factor, a); }
    friend Traced operator/(const Traced& a, double divisor) { return Traced().add(1.0 / divisor, a); }

    void settle();
    int place() const;  // of a settled number; -1: it is 0

private:
    Traced& add(double factor, const Traced& other);

    ProgramBuilder* builder_ = nullptr;  // none: this is 0
    std::vector<LinearProgram::Term> terms_;
};

// Of a sum that is used more than once. Numbers as such are settled.
template <class Number>
void settle(Number&) {}
inline void settle(Traced& number) { number.settle(); }

}  // namespace stepdiag
