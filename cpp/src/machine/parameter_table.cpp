#include "stepdiag/machine/parameter_table.hpp"

#include <cmath>

#include "core/text_file.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

const std::vector<std::string> columns = {"parameter", "position_mm", "value", "unit", "standard_uncertainty"};

// Power of ten from the unit in the file to the native one.
constexpr int micro_to_milli = -3;   // um -> mm
constexpr int micro_to_radian = -6;  // urad -> rad

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

std::string trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(' ');
    return first == std::string_view::npos ? ""
                                           : std::string(text.substr(first, text.find_last_not_of(' ') + 1 - first));
}

class Reader {
public:
    Reader(std::string_view text, const std::string& file_name)
        : file_name_(file_name), csv_(parse_csv(text, file_name)) {}

    ParameterTable read() {
        read_header();
        const bool has_direction =
            csv_.header.fields.size() == columns.size() + 1 && csv_.header.fields.back() == "direction";
        if (has_direction) csv_.header.fields.pop_back();
        if (csv_.header.fields != columns)
            fail(csv_.header.line,
                 "expected the columns parameter,position_mm,value,unit,standard_uncertainty[,direction]");
        for (const CsvRow& row : csv_.rows)
            if (has_direction && !row.fields.back().empty())
                fail(row.line,
                     "direction: tables that depend on direction (reversal) are not supported yet; expected an empty "
                     "field");
        for (const CsvRow& row : csv_.rows) read_row(row);
        return std::move(table_);
    }

private:
    [[noreturn]] void fail(int line, const std::string& why) const {
        throw InvalidArgument(file_name_ + ", line " + std::to_string(line) + ": " + why);
    }

    void read_header() {
        for (const CsvRow& comment : csv_.comments) {
            const std::string_view text = comment.fields.front();
            const auto equals = text.find('=');
            if (equals == std::string_view::npos) continue;  // a remark, not a key
            table_.header[trimmed(text.substr(0, equals))] = trimmed(text.substr(equals + 1));
        }
    }

    double number(const CsvRow& row, int column, int exponent_shift) const {
        const auto value = parse_decimal(row.fields[column], exponent_shift);
        if (!value)
            fail(row.line, columns[column] + ": expected a finite decimal number, got " + quoted(row.fields[column]));
        return *value;
    }

    void read_row(const CsvRow& row) {
        const auto function = FunctionId::parse(row.fields[0]);
        const auto squareness = parse_squareness(row.fields[0]);
        if (!function && !squareness)
            fail(row.line, "parameter: expected EXX ... ECZ, C0Y, B0Z or A0Z, got " + quoted(row.fields[0]));
        const std::string unit = !function || function->is_rotation() ? "urad" : "um";
        if (row.fields[3] != unit)
            fail(row.line,
                 "unit: expected " + quoted(unit) + " for " + row.fields[0] + ", got " + quoted(row.fields[3]));
        const int shift = unit == "um" ? micro_to_milli : micro_to_radian;
        const double value = number(row, 2, shift);
        std::optional<double> uncertainty;
        if (!row.fields[4].empty()) {
            uncertainty = number(row, 4, shift);
            if (*uncertainty < 0.0)
                fail(row.line, "standard_uncertainty: expected at least 0, got " + quoted(row.fields[4]));
        }
        if (function) add_node(row, *function, value, uncertainty);
        else add_squareness(row, *squareness, value, uncertainty);
    }

    void add_node(const CsvRow& row, FunctionId id, double value, std::optional<double> uncertainty) {
        const double position = number(row, 1, 0);
        auto& function = table_.functions[id.index()];
        if (!function) function.emplace();
        if (!function->position.empty() && !(position > function->position.back()))
            fail(row.line,
                 "position_mm: positions of " + id.name() + " must ascend, but " + row.fields[1] + " does not");
        function->position.push_back(position);
        function->value.push_back(value);
        function->standard_uncertainty.push_back(uncertainty);
    }

    void add_squareness(const CsvRow& row, Squareness id, double value, std::optional<double> uncertainty) {
        if (!row.fields[1].empty())
            fail(row.line, "position_mm: expected an empty field for " + name(id) + ", got " + quoted(row.fields[1]));
        auto& entry = table_.squarenesses[static_cast<int>(id)];
        if (entry) fail(row.line, name(id) + " is given twice");
        entry = SquarenessValue{value, uncertainty};
    }

    const std::string& file_name_;
    CsvFile csv_;
    ParameterTable table_;
};

}  // namespace

ParameterTable parse_parameter_table(std::string_view text, const std::string& file_name) {
    return Reader(text, file_name).read();
}

ParameterTable read_parameter_table(const std::string& path) {
    return parse_parameter_table(read_text_file(path), path);
}

std::string format_parameter_table(const ParameterTable& table) {
    std::string text;
    for (const auto& [key, value] : table.header) text += "# " + key + "=" + value + "\n";
    text += "parameter,position_mm,value,unit,standard_uncertainty\n";
    const auto row = [&](const std::string& parameter, const std::string& position, double value, bool rotation,
                         std::optional<double> uncertainty) {
        if (!std::isfinite(value) || !std::isfinite(uncertainty.value_or(0.0)))
            throw InvalidArgument(parameter + ": a value or standard uncertainty is not finite and cannot be written");
        const int shift = rotation ? -micro_to_radian : -micro_to_milli;
        text += parameter + "," + position + "," + format_decimal(value, shift) + (rotation ? ",urad," : ",um,") +
                (uncertainty ? format_decimal(*uncertainty, shift) : "") + "\n";
    };
    for (int i = 0; i < function_count; ++i) {
        if (!table.functions[i]) continue;
        const FunctionTable& function = *table.functions[i];
        for (std::size_t k = 0; k < function.position.size(); ++k)
            row(FunctionId::at(i).name(), format_decimal(function.position[k], 0), function.value[k],
                FunctionId::at(i).is_rotation(), function.standard_uncertainty[k]);
    }
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = table.squarenesses[static_cast<int>(s)])
            row(name(s), "", entry->value, true, entry->standard_uncertainty);
    return text;
}

std::string format_lengths(const Eigen::Vector3d& lengths) {
    return format_decimal(lengths.x(), 0) + " " + format_decimal(lengths.y(), 0) + " " + format_decimal(lengths.z(), 0);
}

void write_parameter_table(const ParameterTable& table, const std::string& path) {
    write_text_file(path, format_parameter_table(table));
}

}  // namespace stepdiag
