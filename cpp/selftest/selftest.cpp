// Cases with a known truth, computed by the library of this installation (docs/selftest.md): a part of those of
// `stepdiag selftest`, for installations without Python. Prints a table. Exit status: 0 if all passed, 3 if one failed,
// 2 if the truth is missing.
//   stepdiag-controller-selftest [FOLDER]   the compensator, with the library for controllers alone
//   stepdiag-selftest [FOLDER]              also adjustments, with the whole library (STEPDIAG_WHOLE_LIBRARY)
// FOLDER has the known truths; by default the installed ones (STEPDIAG_KNOWN).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/core/error.hpp"
#include "stepdiag/machine/parameter_table.hpp"
#include "stepdiag/version.hpp"
#ifdef STEPDIAG_WHOLE_LIBRARY
#include "stepdiag/core/instruction_set.hpp"
#include "stepdiag/diagnosis/adjust.hpp"
#endif

using namespace stepdiag;
namespace fs = std::filesystem;

namespace {

struct Row {
    std::string name, compared;
    int source;  // of the truth: into `sources`
    double deviation, allowed;
    std::string unit = "1";
    std::string error = "";  // of a case that did not come to its end

    bool passed() const { return deviation <= allowed; }  // NaN passes nothing
};
using Rows = std::vector<Row>;

enum Source { none = -1, digits_40, faulty_tables, runs };
constexpr std::array sources = {
    "the conventions, computed by a separate program with 40 digits", "the compensator's table with one fault each",
    "runs made from the conventions (docs/conventions.md) by a separate closed-form program"};

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
void keep_largest(double& largest, double value) {  // NaN stays
    if (!(std::isnan(largest) || std::abs(value) <= largest)) largest = std::abs(value);
}

// --- compensator: tolerances are those of the Python cases -----------------------------------------------------------
constexpr const char* table_file = "compensator_table.csv";
constexpr const char* answers_file = "compensator.csv";
constexpr const char* chain_of_table = "[w Y' b X Z t]";

Rows compensator(const fs::path& known) {
    const auto compensator = Compensator::load((known / table_file).string(), chain_of_table);
    std::ifstream file(known / answers_file);
    std::string line;
    std::getline(file, line);  // names of the columns
    int positions = 0;
    double error = 0.0, rotation = 0.0;
    while (std::getline(file, line)) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream text(line);
        std::array<double, 9> row = {};  // position, error, rotation
        for (double& number : row)
            if (!(text >> number))
                throw InvalidArgument(answers_file + (": expected nine numbers, got \"" + line + "\""));
        const auto found = compensator.error({row[0], row[1], row[2]}, compensator.tool());
        for (int i = 0; i < 3; ++i) {
            keep_largest(error, found.position[i] - row[3 + i]);
            keep_largest(rotation, found.orientation[i] - row[6 + i]);
        }
        ++positions;
    }
    if (positions == 0) error = rotation = nan;
    const std::string of_all = ", " + std::to_string(positions) + " positions";
    // No large numbers are subtracted: errors of 0.1 mm, sums of a dozen products.
    return {{"compensator", "errors" + of_all, digits_40, error, 3e-16, "mm"},
            {"compensator", "rotations" + of_all, digits_40, rotation, 1e-18, "rad"}};
}

template <class Read>
Row refusal(const char* what, const char* named, Read read) {
    bool is_refused = false;
    try {
        read();
    } catch (const InvalidArgument& error) {
        is_refused = std::string(error.what()).find(named) != std::string::npos;
    }
    return {"refused tables", what, faulty_tables, is_refused ? 0.0 : 1.0, 0.0};
}

Rows refusals(const fs::path& known) {
    std::ifstream file(known / table_file);
    std::string damaged(std::istreambuf_iterator<char>(file), {});
    damaged.erase(damaged.rfind(",urad") - 1, 1);
    return {refusal("a digit less in the last row", "sha256", [&] { parse_parameter_table(damaged, table_file); }),
            refusal("the chain of another machine", "chain",
                    [&] { Compensator::load((known / table_file).string(), "[w X' b Y Z t]"); })};
}

#ifdef STEPDIAG_WHOLE_LIBRARY
// --- runs whose machine is known -------------------------------------------------------------------------------------
// What an adjustment knows of a run: as in its scenario.toml, which is for Python.
struct KnownRun {
    std::string name, chain;
    Eigen::Vector3d volume, tool;
    int steps;

    std::string file(const std::string& name_of_file) const { return "runs/" + name + "/" + name_of_file; }
};

Rows run(const fs::path& known, const KnownRun& one) {
    const ErrorMap truth = read_error_map((known / one.file("truth.csv")).string());
    const Plan plan(one.volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")},
                    one.steps, all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")});
    const Calibration found = adjust(read_measurement((known / one.file("measurement.csv")).string()), plan,
                                     Chain::parse(one.chain), one.tool, {})
                                  .calibration;
    double length = 0.0, angle = 0.0;  // what is not determined has no deviation that is allowed
    for (int i = 0; i < function_count; ++i) {
        const FunctionId id = FunctionId::at(i);
        double& largest = id.is_rotation() ? angle : length;
        const auto& function = found.functions[i];
        if (!function || !function->slope_determined || function->position.empty()) largest = nan;
        for (std::size_t k = 0; function && k < function->position.size(); ++k)
            keep_largest(largest, function->value[k] - truth.function(id, function->position[k]));
    }
    for (const Squareness id : all_squarenesses) {
        const auto& squareness = found.squarenesses[static_cast<int>(id)];
        const double edge = plan.volume()[index(squareness_term(id).axis)];  // that it tilts
        keep_largest(length, squareness ? edge * (squareness->value - truth.squareness(id)) : nan);
    }
    // Readings near 1 m are rounded to 1e-13 mm, and steps add up as a random walk.
    const std::string name = "run " + one.name;
    return {{name, "adjustment, lengths", runs, length, 2e-11, "mm"},
            {name, "adjustment, angles", runs, angle, 1e-13, "rad"}};
}

constexpr const char* program = "stepdiag-selftest";
#else
constexpr const char* program = "stepdiag-controller-selftest";
std::string instruction_set() { return "that of the build; the library for controllers chooses none"; }
#endif

// --- table -----------------------------------------------------------------------------------------------------------
struct Case {
    std::string name;
    std::vector<std::string> files;
    std::function<Rows(const fs::path& known)> rows;
};

std::vector<Case> all_cases() {
    std::vector<Case> cases = {{"compensator", {table_file, answers_file}, compensator},
                               {"refused tables", {table_file}, refusals}};
#ifdef STEPDIAG_WHOLE_LIBRARY
    for (const KnownRun& one : {KnownRun{"clean", "[w X' b Y Z t]", {800.0, 600.0, 500.0}, {0.0, 0.0, 0.0}, 20},
                                KnownRun{"misaligned", "[w Y' b X Z t]", {640.0, 480.0, 400.0}, {10.0, 5.0, 80.0}, 16}})
        cases.push_back({"run " + one.name,
                         {one.file("measurement.csv"), one.file("truth.csv")},
                         [one](const fs::path& known) { return run(known, one); }});
#endif
    return cases;
}

Rows rows_of(const Case& one, const fs::path& known) try {
    return one.rows(known);
} catch (const std::exception& error) {
    return {{one.name, "", none, nan, 0.0, "1", error.what()}};
}

void print(const Row& row) {
    std::printf("%s  %-14s  ", row.passed() ? "passed" : "FAILED", row.name.c_str());
    if (row.error.empty())
        std::printf("%-29s  %9.2g  %7.2g  %-4s  [%d]\n", row.compared.c_str(), row.deviation, row.allowed,
                    row.unit.c_str(), row.source + 1);
    else std::printf("%s\n", row.error.c_str());
}

int selftest(const fs::path& known) {
    const std::vector<Case> cases = all_cases();
    for (const Case& one : cases)
        for (const std::string& file : one.files)
            if (!fs::is_regular_file(known / file)) throw InvalidArgument("no file " + (known / file).string());

    std::printf("program          %s\nlibrary          stepdiag %s\ninstruction set  %s\nknown truth      %s\n\n",
                program, version(), instruction_set().c_str(), known.string().c_str());
    std::printf("result  case            compared                       deviation  allowed  unit  truth\n");
    int count = 0, passed = 0, last_source = none;
    for (const Case& one : cases)
        for (const Row& row : rows_of(one, known)) {
            print(row);
            ++count;
            passed += row.passed();
            last_source = std::max(last_source, row.source);
        }
    std::printf("\nThe truth comes from:\n");
    for (int i = 0; i <= last_source; ++i) std::printf("[%d] %s\n", i + 1, sources[i]);
    std::printf("\n%d of %d passed\n", passed, count);
    if (std::fflush(stdout) != 0) throw InvalidArgument("the table cannot be written");
    return passed == count ? 0 : 3;
}

}  // namespace

int main(int count, char** arguments) try {
    if (count > 2 || (count == 2 && *arguments[1] == '-'))
        throw InvalidArgument(std::string("usage: ") + program + " [FOLDER of the known truths]");
    return selftest(count == 2 ? arguments[1] : STEPDIAG_KNOWN);
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 2;
}
