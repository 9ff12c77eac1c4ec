#include "core/text_file.hpp"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <new>
#include <utility>

#include "core/platform.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/version.hpp"

namespace stepdiag {
namespace {

constexpr std::size_t largest_file = std::size_t(1) << 30;
// Some spreadsheet programs write it before the header.
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

std::vector<std::string> parse_record(std::string_view line, const std::string& where) {
    std::vector<std::string> fields;
    csv_parser parser;
    if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) throw std::bad_alloc();
    const auto on_field = [](void* data, std::size_t size, void* out) {
        static_cast<std::vector<std::string>*>(out)->emplace_back(static_cast<const char*>(data), size);
    };
    const bool read = csv_parse(&parser, line.data(), line.size(), on_field, nullptr, &fields) == line.size() &&
                      csv_fini(&parser, on_field, nullptr, &fields) == 0;
    csv_free(&parser);
    if (!read) throw InvalidArgument(where + ": not a CSV record (RFC 4180): a quote is misplaced or not closed");
    return fields;
}

// Parses a whole number with an optional sign. Large values are clamped: as decimal exponents they give 0 or infinity.
std::optional<int> parse_exponent(std::string_view text) {
    constexpr int limit = 100'000;
    const bool negative = !text.empty() && text.front() == '-';
    if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
    if (text.empty() || text.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
    int value = 0;
    for (const char digit : text) value = std::min(limit, 10 * value + (digit - '0'));
    return negative ? -value : value;
}

// Whether a decimal mantissa (no sign) times 10^exponent is below 1.
bool is_small(std::string_view mantissa, int exponent) {
    const auto first = mantissa.find_first_of("123456789");
    const auto point = std::min(mantissa.find('.'), mantissa.size());
    if (first == std::string_view::npos) return true;
    return int(point) - int(first) + exponent <= 0;
}

// Byte index of the first invalid UTF-8 sequence, or npos. Overlong forms and surrogates are accepted, because the text
// is not decoded.
std::size_t first_broken_character(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const std::size_t length = lead < 0x80         ? 1
                                   : lead >> 5 == 0x6  ? 2
                                   : lead >> 4 == 0xE  ? 3
                                   : lead >> 3 == 0x1E ? 4
                                                       : 0;
        if (length == 0 || i + length > text.size()) return i;
        for (std::size_t k = 1; k < length; ++k)
            if ((static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80) return i;
        i += length;
    }
    return std::string_view::npos;
}

}  // namespace

std::string read_text_file(const std::string& path) {
    const std::string text = read_bytes(path, largest_file);
    if (text.empty()) throw InvalidArgument(path + ": the file is empty");
    if (text.find('\0') != std::string::npos) throw InvalidArgument(path + ": expected a text file, got binary data");
    if (const auto broken = first_broken_character(text); broken != std::string::npos) {
        const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(broken), '\n');
        throw InvalidArgument(path + ", line " + std::to_string(line) + ": expected UTF-8 text");
    }
    return text;
}

void write_text_file(const std::string& path, std::string_view text) { replace_file(path, text); }

CsvFile parse_csv(std::string_view text, const std::string& file_name) {
    CsvFile file;
    if (text.substr(0, byte_order_mark.size()) == byte_order_mark) text.remove_prefix(byte_order_mark.size());
    int number = 0;
    while (!text.empty()) {
        const std::string_view rest = text;
        const auto end = text.find('\n');
        std::string_view line = text.substr(0, end);
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
        ++number;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        if (line.find_first_not_of(" \t") == std::string_view::npos) continue;
        if (line.front() == '#' && file.header.fields.empty()) {
            file.comments.push_back({{std::string(line.substr(1))}, number});
            continue;
        }
        const std::string where = file_name + ", line " + std::to_string(number);
        CsvRow row{parse_record(line, where), number};
        if (file.header.fields.empty()) {
            file.header = std::move(row);
            file.body = rest;
            continue;
        }
        if (row.fields.size() != file.header.fields.size())
            throw InvalidArgument(where + ": expected " + std::to_string(file.header.fields.size()) + " fields, got " +
                                  std::to_string(row.fields.size()));
        file.rows.push_back(std::move(row));
    }
    if (file.header.fields.empty()) throw InvalidArgument(file_name + ": has no header row");
    return file;
}

void check_format(const CsvFile& csv, const std::string& file_name, const std::vector<std::string>& expected) {
    for (const CsvRow& comment : csv.comments) {
        const std::string& text = comment.fields.front();
        const auto equals = text.find('=');
        if (equals == std::string::npos || trimmed(text.substr(0, equals)) != "format") continue;
        const std::string given = trimmed(text.substr(equals + 1));
        std::string all, newer;
        for (const std::string& one : expected) {
            if (one == given) return;
            all += (all.empty() ? "\"" : " or \"") + one + "\"";
            newer += newer_format(one, given);
        }
        throw InvalidArgument(file_name + ", line " + std::to_string(comment.line) + ": format: expected " + all +
                              ", got \"" + given + "\"" + newer);
    }
}

std::string trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(' ');
    return first == std::string_view::npos ? ""
                                           : std::string(text.substr(first, text.find_last_not_of(' ') + 1 - first));
}

std::optional<double> parse_decimal(std::string_view text, int exponent_shift) {
    // Only digits and dots: from_chars alone also accepts "inf" and "nan".
    const bool negative = !text.empty() && text.front() == '-';
    if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
    const auto e = text.find_first_of("eE");
    const auto exponent = e == std::string_view::npos ? std::optional(0) : parse_exponent(text.substr(e + 1));
    const std::string_view mantissa = text.substr(0, e);
    if (!exponent || mantissa.find_first_not_of("0123456789.") != std::string_view::npos) return std::nullopt;

    const std::string shifted = std::string(mantissa) + "e" + std::to_string(*exponent + exponent_shift);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(shifted.data(), shifted.data() + shifted.size(), value);
    if (stop != shifted.data() + shifted.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range && is_small(mantissa, *exponent + exponent_shift)) value = 0.0;
    else if (error != std::errc()) return std::nullopt;
    return negative ? -value : value;
}

std::string format_decimal(double value, int exponent_shift) {
    char buffer[64];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific).ptr;
    const std::string_view text(buffer, std::size_t(end - buffer));
    const auto e = text.find('e');
    std::string digits;
    for (const char c : text.substr(0, e))
        if (c >= '0' && c <= '9') digits += c;
    const std::string sign = text.front() == '-' ? "-" : "";
    int exponent = 0;
    const auto first = text.data() + e + (text[e + 1] == '+' ? 2 : 1);
    std::from_chars(first, end, exponent);
    if (value == 0.0) return sign + "0.0";
    exponent += exponent_shift;
    const int size = int(digits.size());
    if (exponent < -5 || exponent > 15)
        return sign + digits.substr(0, 1) + (size > 1 ? "." + digits.substr(1) : "") + "e" + std::to_string(exponent);
    if (exponent < 0) return sign + "0." + std::string(-exponent - 1, '0') + digits;
    if (size <= exponent + 1) return sign + digits + std::string(exponent + 1 - size, '0') + ".0";
    return sign + digits.substr(0, exponent + 1) + "." + digits.substr(exponent + 1);
}

}  // namespace stepdiag
