// A simple binary format: a word that says what it is and of which version, numbers as they are in memory
// (little-endian), a CRC-32 at the end. Internal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace stepdiag {

class ByteWriter {
public:
    explicit ByteWriter(std::string_view kind) : bytes_(kind) {}

    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    void number(Number value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void size(std::size_t value) { number(std::uint64_t(value)); }
    void text(const std::string& text);
    void doubles(const double* values, std::size_t count);  // without their number
    void indices(const std::vector<std::size_t>& values);
    void matrix(const Eigen::MatrixXd& matrix);
    void counts(const std::vector<std::uint32_t>& counts);  // most are small or 0: seven bits a byte, runs of zeros

    std::string finish() &&;

private:
    void variable(std::uint64_t value);
    std::string bytes_;
};

// Throws InvalidArgument, beginning with `name`, where the bytes are not of this kind, damaged, or end too soon.
class ByteReader {
public:
    ByteReader(std::string_view bytes, std::string_view kind, std::string name);

    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    Number number() {
        Number value;
        take(&value, sizeof value);
        return value;
    }
    // A number of things of which each takes a byte or more.
    std::size_t size();
    std::string text();
    void doubles(double* values, std::size_t count) { take(values, count * sizeof(double)); }
    std::vector<std::size_t> indices();
    Eigen::MatrixXd matrix();
    void counts(std::vector<std::uint32_t>& counts);  // as many as there are
    void finish() const;                              // nothing may be left
    void expect(bool condition) const {               // of what was read
        if (!condition) damaged();
    }

private:
    [[noreturn]] void damaged() const;
    void take(void* to, std::size_t size);
    std::uint64_t variable();
    std::string_view left_;
    std::string name_;
};

}  // namespace stepdiag
