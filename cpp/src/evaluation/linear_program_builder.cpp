#include <algorithm>
#include <array>
#include <map>

#include "evaluation/linear_program.hpp"

namespace stepdiag {
namespace {

using Term = LinearProgram::Term;

// A block while it grows: terms by place, a coefficient for each row.
struct OpenBlock {
    std::vector<LinearProgram::Row> rows;
    std::map<int, std::array<double, LinearProgram::most_rows>> terms;
    std::size_t longest = 0;
    std::vector<int> own_places;  // that rows of the builder had

    // Rows whose sums run over nearly the same places share the loads of what stands there.
    bool takes(int base, const std::vector<Term>& more) const {
        if (rows.empty()) return true;
        if (rows.size() == LinearProgram::most_rows) return false;
        const auto is_own = [&](int place) {
            return std::find(own_places.begin(), own_places.end(), place) != own_places.end();
        };
        std::size_t together = terms.size();
        for (const Term& term : more) {
            if (is_own(term.place)) return false;
            together += terms.count(term.place) == 0;
        }
        const std::size_t longer = std::max(longest, more.size());
        return !is_own(base) && 4 * together <= 5 * longer;
    }
};

}  // namespace

int ProgramBuilder::add(std::vector<Term> terms) {
    std::map<int, double> sum;
    for (const Term& term : terms) sum[term.place] += term.coefficient;
    Sum own{-1, {}};
    for (const auto& [place, coefficient] : sum)
        if (coefficient == 1.0) own.base = place;  // the latest: a running sum's last value
    for (const auto& [place, coefficient] : sum)
        if (place != own.base && coefficient != 0.0) own.terms.push_back({place, coefficient});
    sums_.push_back(std::move(own));
    return int(inputs_ + sums_.size()) - 1;
}

std::vector<bool> ProgramBuilder::needed_rows(const std::vector<int>& outputs) const {
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

LinearProgram ProgramBuilder::build(const std::vector<int>& outputs) const {
    const std::vector<bool> needed = needed_rows(outputs);
    std::vector<bool> is_term(needed.size(), false);
    std::vector<int> output_of(needed.size(), -1);
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        if (!needed[inputs_ + i]) continue;
        if (sums_[i].base >= 0) is_term[sums_[i].base] = true;
        for (const Term& term : sums_[i].terms) is_term[term.place] = true;
    }
    // An output that no row of its own can be: 0, an input, or one that stands for several.
    std::vector<std::pair<int, int>> copies;  // of a place, to an output
    for (std::size_t o = 0; o < outputs.size(); ++o) {
        const int place = outputs[o];
        if (place >= int(inputs_) && output_of[place] < 0) {
            output_of[place] = int(o);
        } else {
            copies.push_back({place, int(o)});
            if (place >= 0) is_term[place] = true;
        }
    }

    LinearProgram program;
    program.inputs_ = inputs_;
    program.outputs_ = outputs.size();
    std::vector<int> place_of(needed.size(), -1);
    for (std::size_t i = 0; i < inputs_; ++i) place_of[i] = int(i);
    int places = int(inputs_) + 1;

    OpenBlock block;
    const auto close = [&]() {
        const std::size_t rows = block.rows.size();
        if (rows > 0) program.blocks_.push_back({std::uint32_t(rows), std::uint32_t(block.terms.size())});
        for (const auto& entry : block.terms) {
            program.places_.push_back(std::uint32_t(place_of[entry.first]));
            for (std::size_t r = 0; r < rows; ++r) program.coefficients_.push_back(entry.second[r]);
        }
        program.rows_.insert(program.rows_.end(), block.rows.begin(), block.rows.end());
        block = {};
    };
    const auto place_or_zero = [&](int place) { return place >= 0 ? place_of[place] : int(program.zero()); };
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        const int own = int(inputs_ + i);
        if (!needed[own]) continue;
        if (!block.takes(sums_[i].base, sums_[i].terms)) close();
        if (is_term[own]) place_of[own] = places++;
        for (const Term& term : sums_[i].terms) block.terms[term.place][block.rows.size()] = term.coefficient;
        block.rows.push_back({place_or_zero(sums_[i].base), place_of[own], output_of[own]});
        block.longest = std::max(block.longest, sums_[i].terms.size());
        block.own_places.push_back(own);
    }
    close();
    for (const auto& [place, output] : copies) {
        program.blocks_.push_back({1, 0});
        program.rows_.push_back({place_or_zero(place), -1, output});
    }
    program.registers_ = std::size_t(places);
    return program;
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
