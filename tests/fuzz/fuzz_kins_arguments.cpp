// The load-time arguments of LinuxCNC's kinematics module (controllers/linuxcnc), one a line; the table is one in
// memory. Either all of them are taken and the table is loaded, or a reason is printed and nothing is.
#include <math.h>  // isfinite as C has it

#include <cstdarg>
#include <sstream>
#include <vector>

#include "fuzzing.hpp"
#include "stepdiag/controller/compensator.h"

namespace {

std::string told;  // what the module prints
void print(const char* format, ...) __attribute__((format(printf, 1, 2)));
void print(const char* format, ...) {
    char text[4000];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    told += text;
}
#define RTAPI_MSG_ERR 1
#define rtapi_print_msg(level, ...) print(__VA_ARGS__)

// What stepdiagkins.c declares before it includes its arguments.
const char *table, *chain, *origin, *outside, *margin, *largest_correction, *largest_tool, *approach, *ramp,
    *coordinates, *units, *accept_rejected, *temperatures, *temperature_rate, *accept_unverified;
enum { MAX_JOINTS = 16 };
const char LETTERS[] = "XYZABCUVW";
stepdiag_compensator* compensator;
int axis_of_joint[MAX_JOINTS], joint_count;
double mm_per_unit = 1.0, ramp_ns = 1e9, tool_limit = 1000.0;
double own_tool[3];
int takes_temperatures;
double coldest, warmest, reference, kelvin_per_ns;

#include "../../controllers/linuxcnc/stepdiagkins_arguments.h"

const char* const good_table =
    "# chain=[w X' b Y Z t]\n# volume_mm=800 600 500\n# tool_mm=0 0 30\n"
    "# temperature_reference_c=20\n# expansion_per_k=1.1e-5 1.1e-5 1.1e-5\n"
    "parameter,position_mm,value,unit,standard_uncertainty\nEXX,0,0,um,\nEXX,800,40,um,\nC0Y,,10,urad,\n";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::istringstream lines{std::string(fuzzing::text_before_nul(data, size))};
    std::vector<std::string> given = {"wX'bYZt", "0,0,0", "hold", "0", "1", "1000", "mean",
                                      "1",       "XYZ",   "mm",   "0", "",  "0.1",  "0"};
    for (std::string& argument : given)
        if (std::string line; std::getline(lines, line) && line != "-") argument = line;  // "-": as it is
    const char** const arguments[] = {
        &chain, &origin,      &outside, &margin,          &largest_correction, &largest_tool,     &approach,
        &ramp,  &coordinates, &units,   &accept_rejected, &temperatures,       &temperature_rate, &accept_unverified};
    for (std::size_t i = 0; i < given.size(); ++i) *arguments[i] = given[i].c_str();
    const fuzzing::FileInMemory file(good_table);
    table = file.path().c_str();
    compensator = nullptr;
    told.clear();
    if (read_arguments()) {
        fuzzing::expect(!compensator && told.size() > 20, "a refusal has a reason, and loads nothing");
        return 0;
    }
    fuzzing::expect(compensator && told.empty(), "arguments that are taken load the table");
    fuzzing::expect(joint_count >= 3 && joint_count <= MAX_JOINTS, "there are joints");
    for (int joint = 0; joint < joint_count; ++joint)
        fuzzing::expect(axis_of_joint[joint] >= 0 && axis_of_joint[joint] < 9, "a joint has an axis");
    fuzzing::expect(ramp_ns >= 0.0 && ramp_ns <= 60e9 && tool_limit >= 0.0, "numbers are within their limits");
    fuzzing::expect(!takes_temperatures || (coldest <= reference && reference <= warmest && coldest < warmest),
                    "the reference is in the range");
    fuzzing::expect(kelvin_per_ns > 0.0 && kelvin_per_ns <= 1e-8, "the rate is within its limits");
    stepdiag_compensator_free(compensator);
    return 0;
}
