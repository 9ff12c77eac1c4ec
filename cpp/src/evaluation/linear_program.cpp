#include "evaluation/linear_program.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

#include "core/simd_targets.hpp"
#define HWY_TARGET_INCLUDE "evaluation/linear_program.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for every instruction set
//
#include "core/simd-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

// Where the program has come to.
struct Place {
    const LinearProgram::Row* row;
    const std::uint32_t* source;
    const double* coefficient;
};

// Blocks of one shape for the lanes of `Vectors` vectors: sums stay in registers.
template <std::size_t Rows, bool OfDifferences, std::size_t Vectors>
STEPDIAG_INLINE void run_blocks(const LinearProgram::Blocks& blocks, Place& at, double* registers, double* values,
                                std::size_t stride) {
    const Tag tag;
    const std::size_t width = hn::Lanes(tag);
    const auto load = [&](std::size_t place, std::size_t v)
                          HWY_ATTR { return hn::LoadU(tag, registers + place * program_lanes + v * width); };
    const std::uint32_t terms = blocks.shape.terms;
    for (std::uint32_t block = 0; block < blocks.count; ++block) {
        Vector sum[Rows][Vectors];
        for (std::size_t r = 0; r < Rows; ++r)
            for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::Zero(tag);
        for (std::uint32_t t = 0; t < terms; ++t) {
            Vector value[Vectors];
            for (std::size_t v = 0; v < Vectors; ++v)
                value[v] =
                    OfDifferences ? hn::Sub(load(at.source[0], v), load(at.source[1], v)) : load(at.source[0], v);
            for (std::size_t r = 0; r < Rows; ++r) {
                const Vector coefficient = hn::Set(tag, at.coefficient[r]);
                for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::MulAdd(value[v], coefficient, sum[r][v]);
            }
            at.source += OfDifferences ? 2 : 1;
            at.coefficient += Rows;
        }
        for (std::size_t r = 0; r < Rows; ++r, ++at.row) {
            // The base comes last: of a running sum it is what has to be waited for.
            for (std::size_t v = 0; v < Vectors; ++v) sum[r][v] = hn::Add(sum[r][v], load(at.row->base, v));
            if (at.row->to >= 0)
                for (std::size_t v = 0; v < Vectors; ++v)
                    hn::StoreU(sum[r][v], tag, registers + at.row->to * program_lanes + v * width);
            if (at.row->output >= 0)
                for (std::size_t v = 0; v < Vectors; ++v)
                    hn::StoreU(sum[r][v], tag, values + at.row->output * stride + v * width);
        }
    }
}

template <bool OfDifferences, std::size_t Vectors>
STEPDIAG_INLINE void run_blocks_of(const LinearProgram::Blocks& blocks, Place& at, double* registers, double* values,
                                   std::size_t stride) {
    if (blocks.shape.rows == 3) run_blocks<3, OfDifferences, Vectors>(blocks, at, registers, values, stride);
    else if (blocks.shape.rows == 2) run_blocks<2, OfDifferences, Vectors>(blocks, at, registers, values, stride);
    else run_blocks<1, OfDifferences, Vectors>(blocks, at, registers, values, stride);
}

void run_program(const LinearProgram& program, double* registers, double* values, std::size_t stride) {
    constexpr std::size_t vectors = HWY_TARGET == HWY_SCALAR ? 1 : 2;
    const std::size_t width = vectors * hn::Lanes(Tag());
    std::fill_n(registers + program.zero() * program_lanes, program_lanes, 0.0);
    for (std::size_t lane = 0; lane < program_lanes; lane += width) {
        Place at{program.rows(), program.places(), program.coefficients()};
        for (const LinearProgram::Blocks& blocks : program.blocks()) {
            if (blocks.shape.of_differences)
                run_blocks_of<true, vectors>(blocks, at, registers + lane, values + lane, stride);
            else run_blocks_of<false, vectors>(blocks, at, registers + lane, values + lane, stride);
        }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stepdiag {
namespace {

HWY_EXPORT(run_program);

}  // namespace

void LinearProgram::run(double* registers, double* values, std::size_t stride) const {
    HWY_DYNAMIC_DISPATCH(run_program)(*this, registers, values, stride);
}

// --- writing a program down ---

namespace {

using Term = LinearProgram::Term;
using Shape = LinearProgram::Shape;
using Coefficients = std::array<double, LinearProgram::most_rows>;

// coefficient (place - other place); or, without another one, coefficient place.
struct BlockTerm {
    int place, other;
    Coefficients coefficients;
};

// In pairs of opposite coefficients, where all terms make such pairs.
std::vector<BlockTerm> pair_up(const std::map<int, Coefficients>& terms) {
    std::vector<BlockTerm> all, pairs;
    std::multimap<Coefficients, int> single;
    for (const auto& [place, coefficients] : terms) {
        all.push_back({place, -1, coefficients});
        Coefficients opposite;
        for (std::size_t r = 0; r < opposite.size(); ++r) opposite[r] = 0.0 - coefficients[r];
        if (const auto other = single.find(opposite); other != single.end()) {
            pairs.push_back({place, other->second, coefficients});
            single.erase(other);
        } else {
            single.emplace(coefficients, place);
        }
    }
    return single.empty() ? pairs : all;
}

}  // namespace

// Rows whose sums run over nearly the same places, to share the loads of what stands there.
struct ProgramBuilder::Block {
    std::vector<int> rows;  // of `sums_`
    std::vector<int> bases;
    std::vector<BlockTerm> terms;

    Shape shape() const {
        return {std::uint32_t(rows.size()), std::uint32_t(terms.size()), !terms.empty() && terms[0].other >= 0};
    }
};

int ProgramBuilder::add(std::vector<Term> terms) {
    std::map<int, double> sum;
    for (const Term& term : terms) sum[term.place] += term.coefficient;
    // Beside differences a whole place is what a running sum goes on from.
    Sum own{-1, {}};
    int whole = 0;
    for (const auto& [place, coefficient] : sum) {
        whole += int(coefficient == 1.0) - int(coefficient == -1.0);
        if (coefficient == 1.0) own.base = place;
    }
    if (whole <= 0) own.base = -1;
    for (const auto& [place, coefficient] : sum)
        if (place != own.base && coefficient != 0.0) own.terms.push_back({place, coefficient});
    sums_.push_back(std::move(own));
    return int(inputs_ + sums_.size()) - 1;
}

std::vector<bool> ProgramBuilder::needed_places(const std::vector<int>& outputs) const {
    std::vector<bool> needed(inputs_ + sums_.size(), false);
    for (const int place : outputs)
        if (place >= 0) needed[place] = true;
    for (std::size_t i = sums_.size(); i-- > 0;) {
        if (!needed[inputs_ + i]) continue;
        if (sums_[i].base >= 0) needed[sums_[i].base] = true;
        for (const Term& term : sums_[i].terms) needed[term.place] = true;
    }
    return needed;
}

// In the order in which they were added.
std::vector<ProgramBuilder::Block> ProgramBuilder::make_blocks(const std::vector<bool>& needed) const {
    std::vector<Block> blocks;
    Block block;
    std::map<int, Coefficients> terms;
    std::size_t longest = 0;
    const auto close = [&]() {
        if (block.rows.empty()) return;
        block.terms = pair_up(terms);
        blocks.push_back(std::move(block));
        block = {};
        terms.clear();
        longest = 0;
    };
    const auto fits = [&](const Sum& sum) {
        const int first_own = block.rows.empty() ? int(inputs_ + sums_.size()) : int(inputs_) + block.rows.front();
        std::size_t together = terms.size();
        bool is_independent = sum.base < first_own;
        for (const Term& term : sum.terms) {
            is_independent = is_independent && term.place < first_own;
            together += terms.count(term.place) == 0;
        }
        const std::size_t longer = std::max(longest, sum.terms.size());
        return block.rows.empty() ||
               (is_independent && block.rows.size() < LinearProgram::most_rows && 4 * together <= 5 * longer);
    };
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        if (!needed[inputs_ + i]) continue;
        if (!fits(sums_[i])) close();
        for (const Term& term : sums_[i].terms) terms[term.place][block.rows.size()] = term.coefficient;
        block.rows.push_back(int(i));
        block.bases.push_back(sums_[i].base);
        longest = std::max(longest, sums_[i].terms.size());
    }
    close();
    return blocks;
}

// Blocks that do not hang on each other stand by shape, so that one loop runs over many.
void ProgramBuilder::order_by_shape(std::vector<Block>& blocks) const {
    const auto by_shape = [](const Block& a, const Block& b) {
        const Shape x = a.shape(), y = b.shape();
        return std::tie(x.rows, x.of_differences, x.terms) < std::tie(y.rows, y.of_differences, y.terms);
    };
    auto first = blocks.begin();
    for (auto block = blocks.begin(); block != blocks.end(); ++block) {
        const int first_own = int(inputs_) + first->rows.front();
        const auto is_new = [&](int place) { return place >= first_own; };
        if (std::none_of(block->bases.begin(), block->bases.end(), is_new) &&
            std::none_of(block->terms.begin(), block->terms.end(),
                         [&](const BlockTerm& term) { return is_new(std::max(term.place, term.other)); }))
            continue;
        std::stable_sort(first, block, by_shape);
        first = block;
    }
    std::stable_sort(first, blocks.end(), by_shape);
}

// Gives rows their places, and those of rows and inputs that no later row needs to others.
class ProgramBuilder::Emitter {
public:
    Emitter(std::size_t inputs, std::size_t rows, const std::vector<Block>& blocks, const std::vector<int>& outputs)
        : place_of_(inputs + rows, -1), uses_(inputs + rows, 0), output_of_(inputs + rows, -1) {
        program_.inputs_ = inputs;
        program_.outputs_ = outputs.size();
        program_.registers_ = inputs + 1;
        for (std::size_t i = 0; i < inputs; ++i) place_of_[i] = int(i);
        for (const Block& block : blocks) {
            for (const int base : block.bases) count(base);
            for (const BlockTerm& term : block.terms) count(term.place), count(term.other);
        }
        // An output that no row of its own can be: 0, an input, or one that stands for several.
        for (std::size_t o = 0; o < outputs.size(); ++o) {
            const int place = outputs[o];
            if (place >= int(inputs) && output_of_[place] < 0) output_of_[place] = int(o);
            else copies_.push_back({place, int(o)}), count(place);
        }
        for (std::size_t i = inputs; i-- > 0;)
            if (uses_[i] == 0) free_.push_back(int(i));
    }

    LinearProgram emit(const std::vector<Block>& blocks) {
        for (const Block& block : blocks) emit(block);
        for (const auto& [place, output] : copies_) {
            begin({1, 0, false});
            program_.rows_.push_back({place_or_zero(place), -1, output});
        }
        return std::move(program_);
    }

private:
    void count(int place) {
        if (place >= 0) ++uses_[place];
    }
    void release(int place) {
        if (place >= 0 && --uses_[place] == 0) free_.push_back(place_of_[place]);
    }
    int place_or_zero(int place) const { return place >= 0 ? place_of_[place] : int(program_.zero()); }
    void begin(const Shape& shape) {
        auto& blocks = program_.blocks_;
        if (blocks.empty() || !(blocks.back().shape == shape)) blocks.push_back({shape, 0});
        ++blocks.back().count;
    }

    void emit(const Block& block) {
        begin(block.shape());
        for (const BlockTerm& term : block.terms) {
            program_.places_.push_back(std::uint32_t(place_of_[term.place]));
            if (term.other >= 0) program_.places_.push_back(std::uint32_t(place_of_[term.other]));
            program_.coefficients_.insert(program_.coefficients_.end(), term.coefficients.begin(),
                                          term.coefficients.begin() + std::ptrdiff_t(block.rows.size()));
        }
        // Terms are all read before a row is written; bases row by row.
        for (const BlockTerm& term : block.terms) release(term.place), release(term.other);
        for (std::size_t r = 0; r < block.rows.size(); ++r) {
            const int own = int(program_.inputs_) + block.rows[r];
            if (uses_[own] > 0) place_of_[own] = take_place();
            program_.rows_.push_back({place_or_zero(block.bases[r]), place_of_[own], output_of_[own]});
        }
        for (const int base : block.bases) release(base);
    }

    int take_place() {
        if (free_.empty()) return int(program_.registers_++);
        const int place = free_.back();
        free_.pop_back();
        return place;
    }

    LinearProgram program_;
    std::vector<int> place_of_, uses_, output_of_, free_;
    std::vector<std::pair<int, int>> copies_;  // of a place, to an output
};

LinearProgram ProgramBuilder::build(const std::vector<int>& outputs) const {
    std::vector<Block> blocks = make_blocks(needed_places(outputs));
    order_by_shape(blocks);
    return Emitter(inputs_, sums_.size(), blocks, outputs).emit(blocks);
}

Traced& Traced::add(double factor, const Traced& other) {
    if (other.builder_) builder_ = other.builder_;
    const std::size_t terms = other.terms_.size();  // `other` may be this one
    for (std::size_t i = 0; i < terms; ++i)
        terms_.push_back({other.terms_[i].place, factor * other.terms_[i].coefficient});
    return *this;
}

void Traced::settle() {
    if (terms_.empty() || (terms_.size() == 1 && terms_[0].coefficient == 1.0)) return;
    const int place = builder_->add(std::move(terms_));
    terms_ = {{place, 1.0}};
}

int Traced::place() const { return terms_.empty() ? -1 : terms_[0].place; }

}  // namespace stepdiag
#endif  // HWY_ONCE
