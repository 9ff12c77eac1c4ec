#include "stepdiag/machine/parameter_table.hpp"

#include <algorithm>
#include <cmath>

#include "core/sha256.hpp"
#include "core/text_file.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// Keys written first, because readers look for them first. The other keys follow in alphabetical order.
const std::vector<std::string> first_keys = {"format", "chain", "volume_mm", "tool_mm"};
// They belong to the file and are not kept in the table: the checksum of what follows the leading lines, and the number
// of rows after the header row, which files of earlier versions have in its place.
const std::string checksum_key = "sha256";
const std::string rows_key = "rows";

// Power of ten from the unit in the file to the native one.
constexpr int micro_to_milli = -3;   // um -> mm
constexpr int micro_to_radian = -6;  // urad -> rad

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

// The same for both kinds of line ends, which programs change that do not mean to change a file.
std::string checksum(std::string_view body) {
    std::string text(body);
    for (std::size_t at = 0; (at = text.find("\r\n", at)) != std::string::npos; ++at) text.erase(at, 1);
    return sha256(text);
}

class Reader {
public:
    Reader(std::string_view text, const std::string& file_name)
        : file_name_(file_name), csv_(parse_csv(text, file_name)) {}

    ParameterTable read() {
        read_header();
        find_columns();
        for (const CsvRow& row : csv_.rows) read_row(row);
        for (int i = 0; i < function_count; ++i)
            if (!table_.functions[i]) std::swap(table_.functions[i], table_.negative_functions[i]);
        return std::move(table_);
    }

private:
    enum Column { parameter, position, value, unit, uncertainty, direction, column_count };
    static inline const std::array<std::string, column_count> column_names = {
        "parameter", "position_mm", "value", "unit", "standard_uncertainty", "direction"};

    [[noreturn]] void fail(int line, const std::string& why) const {
        throw InvalidArgument(file_name_ + ", line " + std::to_string(line) + ": " + why);
    }

    void read_header() {
        check_format(csv_, file_name_, {error_map_format, calibration_format});
        bool has_checksum = false;
        for (const CsvRow& comment : csv_.comments) {
            const std::string_view text = comment.fields.front();
            const auto equals = text.find('=');
            if (equals == std::string_view::npos) continue;  // a remark without a key
            const std::string key = trimmed(text.substr(0, equals)), given = trimmed(text.substr(equals + 1));
            if (key == rows_key || key == checksum_key) {
                has_checksum |= key == checksum_key;
                expect(key, comment.line, given,
                       key == rows_key ? std::to_string(csv_.rows.size()) : checksum(csv_.body));
                continue;
            }
            const bool is_known = std::find(first_keys.begin(), first_keys.end(), key) != first_keys.end();
            if (is_known && table_.header.count(key))
                fail(comment.line, "the leading line " + quoted(key) + " is given twice");
            table_.header[key] = given;
        }
        const auto format = table_.header.find("format");
        const bool is_calibration =
            format == table_.header.end() ? table_.header.count("method") > 0 : format->second == calibration_format;
        if (is_calibration && !has_checksum) table_.header.emplace(unverified_key, unverified_because);
    }

    // A file that was cut between two rows, or within the digits of its last number, is otherwise valid.
    void expect(const std::string& key, int line, const std::string& given, const std::string& found) const {
        if (given != found)
            fail(line, key + ": expected " + quoted(given) + ", got " + found +
                           "; the file was cut or changed: without this line it is read as it is, as unverified");
    }

    void find_columns() {
        const auto& names = csv_.header.fields;
        for (std::size_t i = 0; i < names.size(); ++i) {
            const auto known = std::find(column_names.begin(), column_names.end(), names[i]);
            if (known == column_names.end())
                fail(csv_.header.line,
                     "unknown column " + quoted(names[i]) +
                         "; expected parameter,position_mm,value,unit,standard_uncertainty[,direction] in any order");
            auto& field = field_[known - column_names.begin()];
            if (field) fail(csv_.header.line, "the column " + quoted(names[i]) + " is given twice");
            field = i;
        }
        for (int c = 0; c < column_count; ++c)
            if (c != direction && !field_[c])
                fail(csv_.header.line, "the column " + quoted(column_names[c]) + " is missing");
    }

    const std::string& field(const CsvRow& row, Column column) const { return row.fields[*field_[column]]; }

    double number(const CsvRow& row, Column column, int exponent_shift) const {
        const auto number = parse_decimal(field(row, column), exponent_shift);
        if (!number)
            fail(row.line,
                 column_names[column] + ": expected a finite decimal number, got " + quoted(field(row, column)));
        return *number;
    }

    void read_row(const CsvRow& row) {
        const std::string& name = field(row, parameter);
        const auto function = FunctionId::parse(name);
        const auto squareness = parse_squareness(name);
        if (!function && !squareness)
            fail(row.line, "parameter: expected EXX ... ECZ, C0Y, B0Z or A0Z, got " + quoted(name));
        const std::string sign = field_[direction] ? direction_of(row) : "";
        const std::string native = !function || function->is_rotation() ? "urad" : "um";
        if (field(row, unit) != native)
            fail(row.line, "unit: expected " + quoted(native) + " for " + name + ", got " + quoted(field(row, unit)));
        const int shift = native == "um" ? micro_to_milli : micro_to_radian;
        const double error = number(row, value, shift);
        std::optional<double> deviation;
        if (!field(row, uncertainty).empty()) {
            deviation = number(row, uncertainty, shift);
            if (*deviation < 0.0)
                fail(row.line, "standard_uncertainty: expected at least 0, got " + quoted(field(row, uncertainty)));
        }
        if (function) add_node(row, *function, sign == "-", error, deviation);
        else add_squareness(row, *squareness, error, deviation);
    }

    // Returns "", "+" or "-". Either all rows of a parameter have a direction or none has.
    std::string direction_of(const CsvRow& row) {
        const std::string& given = field(row, direction);
        if (!given.empty() && given != "+" && given != "-" && given != "\u2212")
            fail(row.line, "direction: expected + or - or an empty field, got " + quoted(given));
        const std::string sign = given == "\u2212" ? "-" : given;
        const std::string& name = field(row, parameter);
        const bool is_directed = is_directed_.emplace(name, !sign.empty()).first->second;
        if (is_directed == sign.empty())
            fail(row.line, std::string("direction: expected ") + (is_directed ? "+ or -" : "an empty field") +
                               " as in the rows of " + name + " above, got " + quoted(given));
        return sign;
    }

    void add_node(const CsvRow& row, FunctionId id, bool negative, double error, std::optional<double> deviation) {
        const double place = number(row, position, 0);
        auto& function = (negative ? table_.negative_functions : table_.functions)[id.index()];
        if (!function) function.emplace();
        if (!function->position.empty() && !(place > function->position.back()))
            fail(row.line,
                 "position_mm: positions of " + id.name() + " must ascend, but " + field(row, position) + " does not");
        function->position.push_back(place);
        function->value.push_back(error);
        function->standard_uncertainty.push_back(deviation);
    }

    void add_squareness(const CsvRow& row, Squareness id, double error, std::optional<double> deviation) {
        if (!field(row, position).empty())
            fail(row.line,
                 "position_mm: expected an empty field for " + name(id) + ", got " + quoted(field(row, position)));
        auto& entry = table_.squarenesses[static_cast<int>(id)];
        if (entry) fail(row.line, name(id) + " is given twice");
        entry = SquarenessValue{error, deviation};
    }

    const std::string& file_name_;
    CsvFile csv_;
    std::array<std::optional<std::size_t>, column_count> field_;
    std::map<std::string, bool> is_directed_;  // by parameter
    ParameterTable table_;
};

std::string format_header(const std::map<std::string, std::string>& header) {
    std::string text;
    const auto line = [&](const std::string& key, const std::string& given) {
        if (key.find_first_of("=\r\n") != std::string::npos || given.find_first_of("\r\n") != std::string::npos)
            throw InvalidArgument("header " + quoted(key) +
                                  ": expected a key without \"=\" and no line breaks in key or value");
        text += "# " + key + "=" + given + "\n";
    };
    for (const auto& key : first_keys)
        if (const auto entry = header.find(key); entry != header.end()) line(key, entry->second);
    for (const auto& [key, given] : header)
        if (std::find(first_keys.begin(), first_keys.end(), key) == first_keys.end()) line(key, given);
    return text;
}

}  // namespace

double interpolate(const FunctionTable& table, double position) {
    const auto after = std::upper_bound(table.position.begin(), table.position.end(), position);
    if (after == table.position.begin()) return table.value.front();
    if (after == table.position.end()) return table.value.back();
    const auto j = after - table.position.begin();
    const double t = (position - table.position[j - 1]) / (table.position[j] - table.position[j - 1]);
    return table.value[j - 1] + t * (table.value[j] - table.value[j - 1]);
}

ParameterTable parse_parameter_table(std::string_view text, const std::string& file_name) {
    return Reader(text, file_name).read();
}

ParameterTable read_parameter_table(const std::string& path) {
    return parse_parameter_table(read_text_file(path), path);
}

std::string format_parameter_table(const ParameterTable& table) {
    const bool directed = std::any_of(table.negative_functions.begin(), table.negative_functions.end(),
                                      [](const auto& function) { return function.has_value(); });
    std::string text =
        std::string("parameter,position_mm,value,unit,standard_uncertainty") + (directed ? ",direction" : "") + "\n";
    const auto row = [&](const std::string& parameter, const std::string& position, double value, bool rotation,
                         std::optional<double> uncertainty, const char* direction) {
        if (!std::isfinite(value) || !std::isfinite(uncertainty.value_or(0.0)))
            throw InvalidArgument(parameter + ": a value or standard uncertainty is not finite and cannot be written");
        const int shift = rotation ? -micro_to_radian : -micro_to_milli;
        text += parameter + "," + position + "," + format_decimal(value, shift) + (rotation ? ",urad," : ",um,") +
                (uncertainty ? format_decimal(*uncertainty, shift) : "") + (directed ? "," : "") + direction + "\n";
    };
    const auto rows = [&](FunctionId id, const FunctionTable& function, const char* direction) {
        for (std::size_t k = 0; k < function.position.size(); ++k)
            row(id.name(), format_decimal(function.position[k], 0), function.value[k], id.is_rotation(),
                function.standard_uncertainty[k], direction);
    };
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        const auto& function = table.functions[i];
        const auto& negative = table.negative_functions[i];
        if (negative && !function)
            throw InvalidArgument(id.name() + ": has a table of the - direction but none of the + direction");
        if (function) rows(id, *function, negative ? "+" : "");
        if (negative) rows(id, *negative, "-");
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = table.squarenesses[static_cast<int>(s)])
            row(name(s), "", entry->value, true, entry->standard_uncertainty, "");
    const std::string guard = table.header.empty() ? "" : "# " + checksum_key + "=" + checksum(text) + "\n";
    return format_header(table.header) + guard + text;
}

std::string format_lengths(const Eigen::Vector3d& lengths) {
    return format_decimal(lengths.x(), 0) + " " + format_decimal(lengths.y(), 0) + " " + format_decimal(lengths.z(), 0);
}

void write_parameter_table(const ParameterTable& table, const std::string& path) {
    write_text_file(path, format_parameter_table(table));
}

}  // namespace stepdiag
