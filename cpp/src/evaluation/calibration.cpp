#include "stepdiag/evaluation/calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/text_file.hpp"
#include "machine/table_header.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

// A covariance comes from sums over thousands of readings in another order than the standard uncertainties: some 1e-12
// apart, 1e-9 where three close beams tell the angles. What is further apart than this belongs to other values.
constexpr double covariance_tolerance = 1e-6;

constexpr const char* code_letters = "abcdefghijklmnopqrstuvwxyz_";

// NaN: not known.
bool is_uncertainty(double u) { return std::isnan(u) || (std::isfinite(u) && u >= 0.0); }

void check_one_line(const std::string& text, const char* what) {
    if (text.find_first_of("\r\n") != std::string::npos)
        throw InvalidArgument(std::string(what) + ": expected one line of text, got a line break");
}

void check_provenance(const std::map<std::string, std::string>& provenance) {
    for (const auto& [key, text] : provenance) {
        if (std::find(provenance_keys.begin(), provenance_keys.end(), key) == provenance_keys.end()) {
            std::string known;
            for (const char* one : provenance_keys) known += (known.empty() ? "" : ", ") + std::string(one);
            throw InvalidArgument("provenance: expected the keys " + known + ", got \"" + key + "\"");
        }
        if (text.empty()) throw InvalidArgument("provenance, " + key + ": expected a text, got an empty one");
        check_one_line(text, ("provenance, " + key).c_str());
    }
}

void check_sizes(const std::string& name, std::size_t nodes, std::initializer_list<std::size_t> others) {
    if (nodes == 0 || std::any_of(others.begin(), others.end(), [&](std::size_t size) { return size != nodes; }))
        throw InvalidArgument(name + ": expected as many values and uncertainties as positions, and at least one");
}

void check_reversal(const CalibratedReversal& reversal, const std::string& name) {
    check_sizes(
        name, reversal.position.size(),
        {reversal.value.size(), reversal.standard_uncertainty.size(), reversal.negative_standard_uncertainty.size()});
    for (std::size_t k = 0; k < reversal.position.size(); ++k) {
        const std::string node = name + ", node " + std::to_string(k);
        if (!std::isfinite(reversal.position[k]) || !std::isfinite(reversal.value[k]))
            throw InvalidArgument(node + ": position and value must be finite");
        if (k > 0 && !(reversal.position[k] > reversal.position[k - 1]))
            throw InvalidArgument(node + ": positions must ascend");
        if (!is_uncertainty(reversal.standard_uncertainty[k]) ||
            !is_uncertainty(reversal.negative_standard_uncertainty[k]))
            throw InvalidArgument(node + ": standard uncertainties must be finite and at least 0");
    }
}

// The standard uncertainties in the order of the covariance, and the parameter that each belongs to.
struct Uncertainties {
    std::vector<double> u;
    std::vector<std::string> parameter;
};

Uncertainties uncertainties(const Calibration& calibration) {
    Uncertainties all;
    for (int i = 0; i < function_count; ++i)
        if (const auto& function = calibration.functions[i])
            for (const double u : function->standard_uncertainty) {
                all.u.push_back(u);
                all.parameter.push_back(FunctionId::at(i).name());
            }
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)]) {
            all.u.push_back(entry->standard_uncertainty);
            all.parameter.push_back(name(s));
        }
    return all;
}

void check_covariance(const Eigen::MatrixXd& covariance, const Uncertainties& values) {
    const auto size = Eigen::Index(values.u.size());
    if (covariance.rows() != size || covariance.cols() != size)
        throw InvalidArgument("covariance: expected " + std::to_string(size) + " rows and columns, one a value, got " +
                              std::to_string(covariance.rows()) + " by " + std::to_string(covariance.cols()));
    const auto fail = [&](Eigen::Index i, Eigen::Index j, const char* expected) {
        throw InvalidArgument("covariance of " + values.parameter[i] + " and " + values.parameter[j] + ", row " +
                              std::to_string(i) + ", column " + std::to_string(j) + ": " + expected);
    };
    for (Eigen::Index i = 0; i < size; ++i) {
        const double u = values.u[i], variance = covariance(i, i);
        if (!std::isfinite(variance) || variance < 0.0) fail(i, i, "expected a variance, finite and at least 0");
        if (!std::isnan(u) && std::abs(variance - u * u) > covariance_tolerance * u * u)
            fail(i, i, "expected the square of the standard uncertainty");
    }
    for (Eigen::Index j = 0; j < size; ++j)
        for (Eigen::Index i = 0; i < j; ++i) {
            const double most = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
            if (!(std::abs(covariance(i, j)) <= most * (1.0 + covariance_tolerance)))
                fail(i, j, "expected at most the product of the two standard uncertainties");
            if (!(std::abs(covariance(i, j) - covariance(j, i)) <= covariance_tolerance * most))
                fail(i, j, "expected a symmetric matrix");
        }
}

// What the leading lines say in single numbers.
template <class AnyCalibration>
auto numbers(AnyCalibration& calibration) {
    using Entry = std::pair<const char*, decltype((calibration.variance_factor))>;
    return std::array<Entry, 3>{Entry{"variance_factor", calibration.variance_factor},
                                Entry{"uncertainty_scaled", calibration.uncertainty_scaled},
                                Entry{"between_nodes_mm", calibration.between_nodes}};
}

}  // namespace

std::string name(UncertaintySource source) {
    constexpr const char* names[] = {"scale", "temperature", "air"};
    return names[static_cast<int>(source)];
}

void check(const Calibration& calibration) {
    if (!calibration.volume.allFinite() || !(calibration.volume.minCoeff() > 0.0))
        throw InvalidArgument("volume: expected three positive edges in mm");
    if (!calibration.tool.allFinite()) throw InvalidArgument("tool: expected three finite lengths in mm");
    check_one_line(calibration.method, "method");
    check_one_line(calibration.date, "date");
    for (const auto& [key, number] : numbers(calibration))
        if (number && !(std::isfinite(*number) && *number >= 0.0))
            throw InvalidArgument(std::string(key) + ": expected a finite number of at least 0");
    if (calibration.expansion) {
        if (!calibration.temperature_reference)
            throw InvalidArgument("expansion: expected a temperature_reference with it, got none");
        check(Expansion{*calibration.expansion, calibration.fixed_point, *calibration.temperature_reference});
    }
    check_provenance(calibration.provenance);
    for (const std::string& sentence : calibration.undetermined) check_one_line(sentence, "undetermined");
    for (const std::string& sentence : calibration.fit_reasons) check_one_line(sentence, "fit_reasons");
    for (const std::string& code : calibration.fit_codes)
        if (code.empty() || code.find_first_not_of(code_letters) != std::string::npos)
            throw InvalidArgument("fit_codes: expected small letters and _, got \"" + code + "\"");
    if (!calibration.fit_codes.empty() && !calibration.fit_reasons.empty() &&
        calibration.fit_codes.size() != calibration.fit_reasons.size())
        throw InvalidArgument("fit_codes: expected one for each of " + std::to_string(calibration.fit_reasons.size()) +
                              " fit_reasons, got " + std::to_string(calibration.fit_codes.size()));
    for (const std::string& sentence : calibration.unseen_faults) check_one_line(sentence, "unseen_faults");
    for (const std::string& sentence : calibration.conditions) check_one_line(sentence, "conditions");
    check_one_line(calibration.budget, "budget");
    for (int i = 0; i < function_count; ++i) {
        const std::string name = FunctionId::at(i).name();
        if (const auto& f = calibration.functions[i])
            check_sizes(name, f->position.size(), {f->value.size(), f->standard_uncertainty.size()});
        if (const auto& reversal = calibration.reversal[i]) check_reversal(*reversal, "reversal of " + name);
    }
    ErrorMap(to_parameter_table(calibration));  // checks nodes and values of functions
    for (const Squareness s : all_squarenesses)
        if (const auto& entry = calibration.squarenesses[static_cast<int>(s)])
            if (!is_uncertainty(entry->standard_uncertainty))
                throw InvalidArgument(name(s) + ": standard uncertainty must be finite and at least 0");
    if (calibration.covariance.size() > 0) check_covariance(calibration.covariance, uncertainties(calibration));
}

namespace {

constexpr std::string_view sentence_break = " | ";

// An uncertainty that a file did not give is NaN in a Calibration.
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
std::optional<double> if_known(double u) { return std::isnan(u) ? std::nullopt : std::optional(u); }
std::vector<double> or_unknown(const std::vector<std::optional<double>>& uncertainties) {
    std::vector<double> values;
    for (const auto& u : uncertainties) values.push_back(u.value_or(unknown));
    return values;
}

FunctionTable negative_table(const FunctionTable& function, const CalibratedReversal& reversal) {
    FunctionTable negative{reversal.position, {}, {}};
    for (std::size_t k = 0; k < reversal.position.size(); ++k) {
        negative.value.push_back(interpolate(function, reversal.position[k]) - reversal.value[k]);
        negative.standard_uncertainty.push_back(if_known(reversal.negative_standard_uncertainty[k]));
    }
    return negative;
}

CalibratedReversal reversal_of(const FunctionTable& function, const FunctionTable& negative) {
    CalibratedReversal reversal{negative.position, {}, {}, or_unknown(negative.standard_uncertainty)};
    for (std::size_t k = 0; k < negative.position.size(); ++k)
        reversal.value.push_back(interpolate(function, negative.position[k]) - negative.value[k]);
    reversal.standard_uncertainty.assign(negative.position.size(), unknown);
    return reversal;
}

std::string join(const std::vector<std::string>& parts, std::string_view separator) {
    std::string text;
    for (const auto& part : parts) text += (text.empty() ? "" : std::string(separator)) + part;
    return text;
}

}  // namespace

std::string straightness_reference(const Chain& chain, const Eigen::Vector3d& tool) {
    std::vector<std::string> there;
    for (const Axis axis : all_axes)
        for (int across = 0; across < 3; ++across) {
            if (across == index(axis) || !chain.carries_workpiece(axis)) continue;
            const int about = 3 - index(axis) - across;
            const bool cyclic = (about + 1) % 3 == index(axis);  // then about x axis = +across
            there.push_back(FunctionId{axis, Component(across)}.name() + (cyclic ? " + p " : " - p ") +
                            FunctionId{axis, Component(about + 3)}.name());
        }
    if (tool != Eigen::Vector3d::Zero())
        there.push_back(there.empty() ? "those plus rotation x tool offset" : "plus rotation x tool offset");
    return "straightnesses refer to the origin of each axis' own frame; at the functional point they are " +
           (there.empty() ? "the same" : join(there, ", "));
}

std::vector<CalibrationEntry> calibration_entries(const Calibration& calibration) {
    std::vector<CalibrationEntry> entries;
    for (int i = 0; i < function_count; ++i)
        if (const auto& function = calibration.functions[i])
            for (const double position : function->position) entries.push_back({FunctionId::at(i).name(), position});
    for (const Squareness s : all_squarenesses)
        if (calibration.squarenesses[static_cast<int>(s)])
            entries.push_back({name(s), std::numeric_limits<double>::quiet_NaN()});
    return entries;
}

Eigen::VectorXd calibration_values(const Calibration& calibration) {
    std::vector<double> values;
    for (const auto& function : calibration.functions)
        if (function) values.insert(values.end(), function->value.begin(), function->value.end());
    for (const auto& squareness : calibration.squarenesses)
        if (squareness) values.push_back(squareness->value);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), Eigen::Index(values.size()));
}

bool is_anything_determined(const Calibration& calibration) {
    const auto known = [](const auto& parameter) { return parameter.has_value(); };
    return std::any_of(calibration.functions.begin(), calibration.functions.end(), known) ||
           std::any_of(calibration.squarenesses.begin(), calibration.squarenesses.end(), known);
}

ParameterTable to_parameter_table(const Calibration& calibration) {
    ParameterTable table;
    std::vector<std::string> slopes, constants;
    for (int i = 0; i < function_count; ++i) {
        if (!calibration.functions[i]) continue;
        const CalibratedFunction& function = *calibration.functions[i];
        table.functions[i] = FunctionTable{function.position, function.value, {}};
        for (const double u : function.standard_uncertainty)
            table.functions[i]->standard_uncertainty.push_back(if_known(u));
        if (!function.slope_determined) slopes.push_back(FunctionId::at(i).name());
        if (!calibration.reversal[i]) continue;
        table.negative_functions[i] = negative_table(*table.functions[i], *calibration.reversal[i]);
        if (!calibration.reversal[i]->constant_determined) constants.push_back(FunctionId::at(i).name());
    }
    for (int i = 0; i < squareness_count; ++i)
        if (const auto& entry = calibration.squarenesses[i])
            table.squarenesses[i] = SquarenessValue{entry->value, if_known(entry->standard_uncertainty)};
    table.header = {{"format", calibration_format},
                    {"method", calibration.method},
                    {"chain", calibration.chain.name()},
                    {"volume_mm", format_lengths(calibration.volume)},
                    {"tool_mm", format_lengths(calibration.tool)}};
    table.header["straightness_reference"] = straightness_reference(calibration.chain, calibration.tool);
    if (!calibration.date.empty()) table.header["date"] = calibration.date;
    table.header.insert(calibration.provenance.begin(), calibration.provenance.end());
    if (calibration.unverified) table.header[unverified_key] = unverified_because;
    if (calibration.fit) table.header["fit"] = name(*calibration.fit);
    for (const auto& [key, number] : numbers(calibration))
        if (number) table.header[key] = format_decimal(*number, 0);
    if (const auto& reference = calibration.temperature_reference)
        table.header["temperature_reference_c"] = format_decimal(*reference, 0);
    else if (const auto& found = calibration.temperature_as_found)
        table.header["temperature_as_found_c"] = format_lengths(*found);
    if (calibration.expansion) {
        table.header["expansion_per_k"] = format_lengths(*calibration.expansion);
        table.header["fixed_point_mm"] = format_lengths(calibration.fixed_point);
    }
    if (!calibration.fit_codes.empty()) table.header["fit_codes"] = join(calibration.fit_codes, " ");
    if (!calibration.fit_reasons.empty()) table.header["fit_reasons"] = join(calibration.fit_reasons, sentence_break);
    if (!calibration.unseen_faults.empty())
        table.header["unseen_faults"] = join(calibration.unseen_faults, sentence_break);
    if (!calibration.conditions.empty()) table.header["conditions"] = join(calibration.conditions, sentence_break);
    if (!calibration.budget.empty()) table.header["budget"] = calibration.budget;
    if (calibration.method == "conventional" || calibration.method == "enhanced")
        table.header["uncertainties"] = "of the noise of the readings alone";
    if (!slopes.empty()) table.header["undetermined_slopes"] = join(slopes, " ");
    if (!constants.empty()) table.header["undetermined_reversal_constants"] = join(constants, " ");
    std::vector<std::string> undetermined = calibration.undetermined;
    if (undetermined.empty())
        for (const Undetermined& finding : calibration.findings) undetermined.push_back(text(finding));
    if (!undetermined.empty()) table.header["undetermined"] = join(undetermined, sentence_break);
    return table;
}

void write_calibration(const Calibration& calibration, const std::string& path) {
    write_parameter_table(to_parameter_table(calibration), path);
}

namespace {

// The tables of a file.
void take_values(const ParameterTable& table, const std::string& path, Calibration& calibration) {
    const auto slopes = functions_listed(table, "undetermined_slopes", path);
    const auto constants = functions_listed(table, "undetermined_reversal_constants", path);
    for (int i = 0; i < function_count; ++i) {
        if (!table.functions[i]) continue;
        const std::string name = FunctionId::at(i).name();
        const FunctionTable& source = *table.functions[i];
        calibration.functions[i] = CalibratedFunction{source.position, source.value,
                                                      or_unknown(source.standard_uncertainty), slopes.count(name) == 0};
        if (!table.negative_functions[i]) continue;
        calibration.reversal[i] = reversal_of(source, *table.negative_functions[i]);
        calibration.reversal[i]->constant_determined = constants.count(name) == 0;
    }
    for (int i = 0; i < squareness_count; ++i)
        if (const auto& entry = table.squarenesses[i])
            calibration.squarenesses[i] =
                CalibratedSquareness{entry->value, entry->standard_uncertainty.value_or(unknown)};
}

}  // namespace

Calibration read_calibration(const std::string& path) {
    const ParameterTable table = ErrorMap(read_parameter_table(path)).table();
    const auto optional_value = [&](const char* key) {
        const auto entry = table.header.find(key);
        return entry == table.header.end() ? std::string() : entry->second;
    };
    Calibration calibration{optional_value("method"),
                            chain_of(table, path),
                            lengths_of(table, "volume_mm", path),
                            lengths_of(table, "tool_mm", path),
                            {},
                            {}};
    calibration.undetermined = split(optional_value("undetermined"), sentence_break);
    calibration.fit_codes = split(optional_value("fit_codes"), " ");
    calibration.fit_reasons = split(optional_value("fit_reasons"), sentence_break);
    calibration.unseen_faults = split(optional_value("unseen_faults"), sentence_break);
    calibration.conditions = split(optional_value("conditions"), sentence_break);
    calibration.budget = optional_value("budget");
    calibration.date = optional_value("date");
    for (const char* key : provenance_keys)
        if (std::string text = optional_value(key); !text.empty()) calibration.provenance[key] = std::move(text);
    calibration.unverified = table.header.count(unverified_key) > 0;
    calibration.fit = fit_of(table.header, path);
    for (auto& [key, number] : numbers(calibration)) {
        const std::string given = optional_value(key);
        if (given.empty()) continue;
        number = parse_decimal(given, 0);
        if (!number || *number < 0.0)
            throw InvalidArgument(path + ": " + key + ": expected a number of at least 0, got \"" + given + "\"");
    }
    if (const std::string given = optional_value("temperature_reference_c"); !given.empty()) {
        calibration.temperature_reference = parse_decimal(given, 0);
        if (!calibration.temperature_reference)
            throw InvalidArgument(path + ": temperature_reference_c: expected a temperature, got \"" + given + "\"");
    }
    if (!optional_value("temperature_as_found_c").empty())
        calibration.temperature_as_found = lengths_of(table, "temperature_as_found_c", path);
    if (const auto expansion = expansion_of(table, path)) {
        calibration.temperature_reference = expansion->reference;
        calibration.expansion = expansion->coefficient;
        calibration.fixed_point = expansion->fixed_point;
    }
    take_values(table, path, calibration);
    if (!(calibration.volume.minCoeff() > 0.0))
        throw InvalidArgument(path + ": volume_mm: expected three positive edges");
    return calibration;
}

}  // namespace stepdiag
