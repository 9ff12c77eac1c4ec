#include "monte_carlo/byte_format.hpp"

#include <boost/crc.hpp>
#include <cstring>
#include <limits>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

std::uint32_t checksum(std::string_view bytes) {
    boost::crc_32_type crc;
    crc.process_bytes(bytes.data(), bytes.size());
    return crc.checksum();
}

}  // namespace

void ByteWriter::text(const std::string& text) {
    size(text.size());
    bytes_ += text;
}

void ByteWriter::doubles(const double* values, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(double));
}

void ByteWriter::indices(const std::vector<std::size_t>& values) {
    size(values.size());
    for (const std::size_t value : values) size(value);
}

void ByteWriter::matrix(const Eigen::MatrixXd& matrix) {
    size(std::size_t(matrix.rows()));
    size(std::size_t(matrix.cols()));
    doubles(matrix.data(), std::size_t(matrix.size()));
}

void ByteWriter::variable(std::uint64_t value) {
    for (; value >= 128; value >>= 7) bytes_.push_back(char((value & 127) | 128));
    bytes_.push_back(char(value));
}

// A zero is followed by the number of further zeros.
void ByteWriter::counts(const std::vector<std::uint32_t>& counts) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
        variable(counts[i]);
        if (counts[i] != 0) continue;
        const std::size_t first = i;
        while (i + 1 < counts.size() && counts[i + 1] == 0) ++i;
        variable(i - first);
    }
}

std::string ByteWriter::finish() && {
    number(checksum(bytes_));
    return std::move(bytes_);
}

ByteReader::ByteReader(std::string_view bytes, std::string_view kind, std::string name)
    : left_(bytes), name_(std::move(name)) {
    if (left_.substr(0, kind.size()) != kind)
        throw InvalidArgument(name_ + ": expected bytes that begin with \"" + std::string(kind) +
                              "\"; these are of another kind or version");
    if (left_.size() < kind.size() + sizeof(std::uint32_t)) damaged();
    std::uint32_t expected;
    std::memcpy(&expected, left_.data() + left_.size() - sizeof expected, sizeof expected);
    left_.remove_suffix(sizeof expected);
    if (checksum(left_) != expected) damaged();
    left_.remove_prefix(kind.size());
}

void ByteReader::damaged() const { throw InvalidArgument(name_ + ": the bytes are damaged or incomplete"); }

void ByteReader::take(void* to, std::size_t size) {
    if (size > left_.size()) damaged();
    if (size > 0) std::memcpy(to, left_.data(), size);
    left_.remove_prefix(size);
}

std::size_t ByteReader::size() {
    const auto value = number<std::uint64_t>();
    if (value > left_.size()) damaged();
    return std::size_t(value);
}

std::string ByteReader::text() {
    std::string text(size(), '\0');
    take(text.data(), text.size());
    return text;
}

std::vector<std::size_t> ByteReader::indices() {
    std::vector<std::size_t> values(size());
    for (std::size_t& value : values) value = std::size_t(number<std::uint64_t>());
    return values;
}

Eigen::MatrixXd ByteReader::matrix() {
    const auto rows = number<std::uint64_t>(), columns = number<std::uint64_t>();
    const std::uint64_t fits = left_.size() / sizeof(double);
    if (columns > std::numeric_limits<std::uint32_t>::max() || rows > std::numeric_limits<std::uint32_t>::max() ||
        rows * columns > fits)
        damaged();
    Eigen::MatrixXd matrix(rows, columns);
    doubles(matrix.data(), std::size_t(matrix.size()));
    return matrix;
}

std::uint64_t ByteReader::variable() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
        const auto byte = number<std::uint8_t>();
        value |= std::uint64_t(byte & 127) << shift;
        if (byte < 128) return value;
    }
    damaged();
}

void ByteReader::counts(std::vector<std::uint32_t>& counts) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
        counts[i] = std::uint32_t(variable());
        if (counts[i] != 0) continue;
        const std::uint64_t more = variable();
        if (more >= counts.size() - i) damaged();
        for (const std::size_t last = i + std::size_t(more); i < last;) counts[++i] = 0;
    }
}

void ByteReader::finish() const {
    if (!left_.empty()) damaged();
}

}  // namespace stepdiag
