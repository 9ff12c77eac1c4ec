// Reading and writing the small text files of the project. Internal: not installed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stepdiag {

// The whole file. Throws InvalidArgument when it cannot be read, holds NUL bytes, or is larger than 1 GiB.
std::string read_text_file(const std::string& path);

// Writes to a temporary file in the same folder and renames it, so that `path` is the old file or the whole new one.
void write_text_file(const std::string& path, std::string_view text);

// One record of a CSV file (RFC 4180, parsed by libcsv) and the line it stands in, counted from 1.
struct CsvRow {
    std::vector<std::string> fields;
    int line;
};

struct CsvFile {
    std::vector<CsvRow> comments;  // leading "# ..." lines, each one field without the "#"
    CsvRow header;
    std::vector<CsvRow> rows;  // each with as many fields as the header; blank lines are skipped
};

// Throws InvalidArgument naming `file_name` and line.
CsvFile parse_csv(std::string_view text, const std::string& file_name);

// Decimal text <-> double with a power of ten between them, exact to the last bit in both directions:
// parse_decimal("2.5", -6) is the double nearest to 2.5e-6, format_decimal(2.5e-6, 6) is "2.5", the shortest text that
// parses back. (Multiplying by 1e6 would round twice.)
std::optional<double> parse_decimal(std::string_view text, int exponent_shift);
std::string format_decimal(double value, int exponent_shift);

}  // namespace stepdiag
