#include "controller/fingerprint.hpp"

#include <cstring>
#include <string>

namespace stepdiag {
namespace {

class Hash {
public:
    void add(std::uint64_t word) {
        for (int byte = 0; byte < 8; ++byte, word >>= 8) value_ = (value_ ^ (word & 0xFF)) * prime;
    }
    void add(double number) {
        number += 0.0;  // changes -0 to 0, which is the same position or error
        std::uint64_t bits;
        std::memcpy(&bits, &number, sizeof bits);
        add(bits);
    }
    void add(const std::string& text) {
        add(std::uint64_t(text.size()));
        for (const char c : text) add(std::uint64_t(static_cast<unsigned char>(c)));
    }
    void add(const std::vector<double>& numbers) {
        add(std::uint64_t(numbers.size()));
        for (const double number : numbers) add(number);
    }
    void add(const std::optional<FunctionTable>& function) {
        add(std::uint64_t(function.has_value()));
        if (!function) return;
        add(function->position);
        add(function->value);
    }
    std::uint64_t value() const { return value_; }

private:
    static constexpr std::uint64_t prime = 0x100000001b3;
    std::uint64_t value_ = 0xcbf29ce484222325;
};

}  // namespace

std::uint64_t fingerprint(const Chain& chain, const Eigen::Vector3d& volume, const Eigen::Vector3d& tool,
                          const ParameterTable& table, const std::optional<Expansion>& expansion) {
    Hash hash;
    hash.add(chain.name());
    for (const double length : volume) hash.add(length);
    for (const double length : tool) hash.add(length);
    for (int i = 0; i < function_count; ++i) {
        hash.add(table.functions[i]);
        hash.add(table.negative_functions[i]);
    }
    for (const auto& squareness : table.squarenesses) {
        hash.add(std::uint64_t(squareness.has_value()));
        if (squareness) hash.add(squareness->value);
    }
    if (expansion) {
        for (const double coefficient : expansion->coefficient) hash.add(coefficient);
        for (const double position : expansion->fixed_point) hash.add(position);
        hash.add(expansion->reference);
    }
    return hash.value();
}

}  // namespace stepdiag
