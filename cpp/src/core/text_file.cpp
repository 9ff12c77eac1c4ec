#include "core/text_file.hpp"

#include <csv.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// The header of the file is the row that names its columns; a spreadsheet may put a byte order mark before it.
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

}  // namespace

std::string read_text_file(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) throw InvalidArgument(path + ": cannot be read: " + std::strerror(errno));
    if (S_ISDIR(status.st_mode)) throw InvalidArgument(path + ": expected a file, got a folder");
    if (status.st_size > (off_t(1) << 30)) throw InvalidArgument(path + ": larger than 1 GiB, which no file of ours is");
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream content;
    content << stream.rdbuf();
    if (!stream) throw InvalidArgument(path + ": cannot be read: " + std::strerror(errno));
    std::string text = content.str();
    if (text.empty()) throw InvalidArgument(path + ": the file is empty");
    if (text.find('\0') != std::string::npos) throw InvalidArgument(path + ": expected a text file, got binary data");
    return text;
}

void write_text_file(const std::string& path, std::string_view text) {
    std::string temporary = path + ".XXXXXX";
    const auto fail = [&](const std::string& what) {
        const std::string why = std::strerror(errno);
        ::unlink(temporary.c_str());
        throw InvalidArgument(path + ": " + what + ": " + why);
    };
    const int file = ::mkstemp(temporary.data());
    if (file < 0) fail("cannot be written");
    bool written = true;
    for (std::size_t done = 0; written && done < text.size();) {
        const auto count = ::write(file, text.data() + done, text.size() - done);
        written = count > 0;
        if (written) done += std::size_t(count);
    }
    const mode_t mask = ::umask(0);
    ::umask(mask);
    written = written && ::fchmod(file, 0666 & ~mask) == 0 && ::fsync(file) == 0;
    if (::close(file) != 0 || !written) fail("cannot be written");
    if (::rename(temporary.c_str(), path.c_str()) != 0) fail("cannot be replaced");
}

CsvFile parse_csv(std::string_view text, const std::string& file_name) {
    CsvFile file;
    if (text.substr(0, byte_order_mark.size()) == byte_order_mark) text.remove_prefix(byte_order_mark.size());
    int number = 0;
    while (!text.empty()) {
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
            continue;
        }
        if (row.fields.size() != file.header.fields.size())
            throw InvalidArgument(where + ": expected " + std::to_string(file.header.fields.size()) + " fields, got " + std::to_string(row.fields.size()));
        file.rows.push_back(std::move(row));
    }
    if (file.header.fields.empty()) throw InvalidArgument(file_name + ": has no header row");
    return file;
}

std::string csv_field(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
    std::string quoted(csv_write2(nullptr, 0, text.data(), text.size(), '"'), '\0');
    csv_write2(quoted.data(), quoted.size(), text.data(), text.size(), '"');
    return quoted;
}

std::optional<double> parse_decimal(std::string_view text, int exponent_shift) {
    // Digits and dots only: from_chars alone would take "inf" and "nan" as well.
    if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string_view::npos) return std::nullopt;
    if (text.front() == '+') text.remove_prefix(1);
    const auto e = text.find_first_of("eE");
    int exponent = 0;
    if (e != std::string_view::npos) {
        std::string_view digits = text.substr(e + 1);
        if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
        const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
        if (error != std::errc() || stop != digits.data() + digits.size()) return std::nullopt;
    }
    const std::string shifted = std::string(text.substr(0, e)) + "e" + std::to_string(exponent + exponent_shift);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(shifted.data(), shifted.data() + shifted.size(), value);
    if (stop != shifted.data() + shifted.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range && exponent < 0) return 0.0;  // too small for a double
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    return value;
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
