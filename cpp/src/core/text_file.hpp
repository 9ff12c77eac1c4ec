// Reading and writing the small text files of the project. Internal: not installed.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stepdiag {

// Reads the whole file. Throws InvalidArgument if it cannot be read, is empty, is larger than 1 GiB, contains NUL
// bytes, is not UTF-8, or is a pipe that no program opens for writing within two seconds.
std::string read_text_file(const std::string& path);

// Writes to a temporary file in the same folder, then renames it. `path` is never a partly written file. Throws
// InvalidArgument if the file cannot be written.
void write_text_file(const std::string& path, std::string_view text);

// One record of a CSV file (RFC 4180, parsed by libcsv) and its line number, counted from 1.
struct CsvRow {
    std::vector<std::string> fields;
    int line;
};

struct CsvFile {
    std::vector<CsvRow> comments;  // leading "# ..." lines, each as one field without the "#"
    CsvRow header;
    std::vector<CsvRow> rows;  // each with as many fields as the header; blank lines are skipped
    std::string_view body;     // of the text that was parsed: from the header row to the end
};

// Throws InvalidArgument, which names `file_name` and line, for text that is not CSV, a row with another number of
// fields than the header, or a missing header.
CsvFile parse_csv(std::string_view text, const std::string& file_name);

// Checks the leading line "# format=..." of a file that has one. Throws InvalidArgument, which names `file_name` and
// line, for a text other than those in `expected`.
void check_format(const CsvFile& csv, const std::string& file_name, const std::vector<std::string>& expected);

// Without the spaces at both ends.
std::string trimmed(std::string_view text);

// Converts between decimal text and double with a power of ten as factor. Both directions are exact to the last bit:
// parse_decimal("2.5", -6) is the double nearest to 2.5e-6; format_decimal(2.5e-6, 6) is "2.5", the shortest text that
// parses back. Multiplying by 1e6 instead would round twice.
std::optional<double> parse_decimal(std::string_view text, int exponent_shift);
std::string format_decimal(double value, int exponent_shift);

}  // namespace stepdiag
