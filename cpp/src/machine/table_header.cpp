#include "machine/table_header.hpp"

#include "core/text_file.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

std::string header_value(const ParameterTable& table, const std::string& key, const std::string& name) {
    const auto entry = table.header.find(key);
    if (entry == table.header.end())
        throw InvalidArgument(name + ": the leading line \"# " + key +
                              "=...\" is missing; a calibration needs chain, volume_mm and tool_mm");
    return entry->second;
}

}  // namespace

std::vector<std::string> split(std::string_view text, std::string_view separator) {
    std::vector<std::string> parts;
    while (!text.empty()) {
        const auto end = text.find(separator);
        parts.emplace_back(text.substr(0, end));
        text.remove_prefix(end == std::string_view::npos ? text.size() : end + separator.size());
    }
    return parts;
}

Chain chain_of(const ParameterTable& table, const std::string& name) {
    const std::string text = header_value(table, "chain", name);
    try {
        return Chain::parse(text);
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(name + ": " + error.what());
    }
}

Eigen::Vector3d lengths_of(const ParameterTable& table, const std::string& key, const std::string& name) {
    const std::string text = header_value(table, key, name);
    const auto parts = split(text, " ");
    Eigen::Vector3d lengths;
    for (int i = 0; i < 3; ++i) {
        const auto value = parts.size() == 3 ? parse_decimal(parts[i], 0) : std::nullopt;
        if (!value)
            throw InvalidArgument(name + ": " + key + ": expected three numbers with a space between, got \"" + text +
                                  "\"");
        lengths[i] = *value;
    }
    return lengths;
}

std::optional<Expansion> expansion_of(const ParameterTable& table, const std::string& name) {
    if (table.header.count("expansion_per_k") == 0) return std::nullopt;
    const auto given = table.header.find("temperature_reference_c");
    const auto reference = given == table.header.end() ? std::nullopt : parse_decimal(given->second, 0);
    if (!reference)
        throw InvalidArgument(name + ": temperature_reference_c: expected a temperature with expansion_per_k, got " +
                              (given == table.header.end() ? "none" : "\"" + given->second + "\""));
    Expansion expansion{lengths_of(table, "expansion_per_k", name), Eigen::Vector3d::Zero(), *reference};
    if (table.header.count("fixed_point_mm") > 0) expansion.fixed_point = lengths_of(table, "fixed_point_mm", name);
    try {
        check(expansion);
    } catch (const InvalidArgument& error) {
        throw InvalidArgument(name + ": " + error.what());
    }
    return expansion;
}

std::set<std::string> functions_listed(const ParameterTable& table, const std::string& key, const std::string& name) {
    std::set<std::string> names;
    const auto entry = table.header.find(key);
    if (entry == table.header.end()) return names;
    for (const std::string& function : split(entry->second, " ")) {
        if (!FunctionId::parse(function))
            throw InvalidArgument(name + ": " + key + ": expected names of error functions, got \"" + function + "\"");
        names.insert(function);
    }
    return names;
}

}  // namespace stepdiag
