// SPDX-License-Identifier: GPL-2.0-or-later
// Kinematics module for LinuxCNC: trivial Cartesian kinematics of a three-axis machine with volumetric compensation by
// a table of stepdiag (compensator.h, BSD-3-Clause). Lengths in mm.
//   inverse   joints = command(world)      axis positions that bring the tool to world
//   forward   world  = forward(joints)     position of the tool if the axes are at joints
// Both use a share s in 0..1 of the correction and a tool, which are the same in both directions at any time:
//   joints = world + s (command(world) - world)
// s and tool change only by ramps, in one small step per servo cycle; so do the temperatures of the scales, if the
// argument `temperatures` lets the pins state them, at a limited rate. See docs/linuxcnc.md.
//
// LinuxCNC calls both directions from its servo thread only. It calls the inverse also for targets that it only checks.
// As soon as all joints are homed, it calls the forward once per cycle with the joints' feedback (in joint mode a
// second time, with their commands). For this reason the forward advances the ramp and sets the pins.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compensator.h"
#include "hal.h"
#include "kinematics.h"
#include "rtapi.h"
#include "rtapi_app.h"

MODULE_LICENSE("GPL");

static char* table = "";
RTAPI_MP_STRING(table, "calibration file (CSV)");
static char* chain = "";
RTAPI_MP_STRING(chain, "kinematic chain from workpiece to tool: wXbYZt");
static char* origin = "0,0,0";
RTAPI_MP_STRING(origin, "machine coordinates of the corner of the calibrated volume, mm");
static char* outside = "hold";
RTAPI_MP_STRING(outside, "outside the volume: hold, linear or refuse");
static char* margin = "0";
RTAPI_MP_STRING(margin, "how far outside linear goes on, mm");
static char* largest_correction = "1";
RTAPI_MP_STRING(largest_correction, "longer corrections are cut to this length, mm");
static char* largest_tool = "1000";
RTAPI_MP_STRING(largest_tool, "longer tools are not taken from the pins, mm");
static char* approach = "mean";
RTAPI_MP_STRING(approach, "of a table with reversal: mean, positive or negative");
static char* accept_rejected = "0";
RTAPI_MP_STRING(accept_rejected, "1: takes a calibration whose fit was rejected");
static char* accept_unverified = "0";
RTAPI_MP_STRING(accept_unverified, "1: takes a calibration whose checksum was absent when it was read");
static char* temperatures = "";
RTAPI_MP_STRING(temperatures, "lowest and highest temperature of the scales, degrees Celsius: 10,35; none: no pins");
static char* temperature_rate = "0.1";
RTAPI_MP_STRING(temperature_rate, "fastest change of the temperatures in force, K/s");
static char* ramp = "1";
RTAPI_MP_STRING(ramp, "duration of a change of enable or tool, s");
static char* coordinates = "XYZ";
RTAPI_MP_STRING(coordinates, "letter of the axis of each joint");
static char* units = "mm";
RTAPI_MP_STRING(units, "the machine's linear unit: mm or inch");

enum { MAX_JOINTS = 16, TOOL_IGNORED = 8 };
static const char LETTERS[] = "XYZABCUVW";

// Settings of the compensation. `tool`: offset of the functional point from the tool's origin, mm.
typedef struct {
    double share;
    double tool[3];
} setting;

typedef struct {
    hal_bit_t *enable, *use_tool, *inside, *temperature_enable, *temperature_fault;
    hal_float_t *tool_offset[3], *error[3], *correction[3], *tool[3], *applied;
    hal_float_t *temperature[3], *temperature_applied[3];  // with the argument `temperatures` only
    hal_u32_t *status, *refusals, *table_id_low, *table_id_high;
} pins;

static int component = -1;
static stepdiag_compensator* compensator;
static pins* pin;
static int axis_of_joint[MAX_JOINTS], joint_count;
static double mm_per_unit = 1.0, ramp_ns = 1e9, tool_limit = 1000.0;
static setting before, now, wanted;  // a ramp changes `now` from `before` to `wanted`; it began at the time `begun`
static double own_tool[3];           // tool of the calibration
static long long begun;
static int ramping, started;

// Temperatures of the scales, degrees Celsius.
static int takes_temperatures;
static double coldest, warmest, reference, kelvin_per_ns;
static double in_force[3];  // the reference: as the calibration says, the scales add nothing
static long long warmed;    // time of the last change

// --- current setting ---
// Reads the tool from the pins; returns 0 if it is not a valid tool. The sign changes, because LinuxCNC adds
// motion.tooloffset to the point of the tool to get the tool's origin.
static int tool_of_pins(double tool[3]) {
    double square = 0.0;
    for (int i = 0; i < 3; ++i) {
        tool[i] = -*pin->tool_offset[i] * mm_per_unit;
        square += tool[i] * tool[i];
    }
    return islessequal(square, tool_limit * tool_limit);  // false for a NaN, without an exception
}

static int same(const setting* a, const setting* b) { return memcmp(a, b, sizeof *a) == 0; }

// Moves the temperatures in force towards those of the pins or, without temperature-enable, towards the reference. The
// rate is limited: neither a sensor that jumps nor the switch makes the joints jump. A sensor that is not in the range,
// or not a number, holds its axis at the temperature in force. Returns flags for the status.
static unsigned advance_temperatures(long long time) {
    static const double longest_ns = 1e8;  // a pause, such as an axis that is homed again, does not add up
    unsigned flags = 0;
    if (!takes_temperatures) return 0;
    const double step = kelvin_per_ns * fmin((double)(time - warmed), longest_ns);
    warmed = time;
    for (int i = 0; i < 3; ++i) {
        double asked = reference;
        if (*pin->temperature_enable) {
            asked = *pin->temperature[i];
            if (!(isgreaterequal(asked, coldest) && islessequal(asked, warmest))) {
                asked = in_force[i];
                flags = STEPDIAG_TEMPERATURE;
            }
        }
        const double change = asked - in_force[i];
        if (!started || fabs(change) <= step) in_force[i] = asked;
        else in_force[i] += copysign(step, change);
        *pin->temperature_applied[i] = in_force[i];
    }
    *pin->temperature_fault = flags != 0;
    return flags;
}

// NULL where all scales are at the reference: the calibration as it is.
static const double* temperature_in_force(void) {
    const int cold = in_force[0] == reference && in_force[1] == reference && in_force[2] == reference;
    return takes_temperatures && !cold ? in_force : NULL;
}

// Makes one step of the ramp 3u² - 2u³, which has no jump of speed at its ends. A ramp always finishes before the pins
// are read again. Returns flags for the status.
static unsigned advance(void) {
    setting asked = now;
    unsigned flags = 0;
    asked.share = *pin->enable ? 1.0 : 0.0;
    if (!*pin->use_tool) memcpy(asked.tool, own_tool, sizeof asked.tool);
    else if (!tool_of_pins(asked.tool)) {
        memcpy(asked.tool, now.tool, sizeof asked.tool);
        flags = TOOL_IGNORED;
    }
    const long long time = rtapi_get_time();
    flags |= advance_temperatures(time);
    if (!started) now = asked;  // first cycle after homing: kinematics do not move the machine yet
    started = 1;
    if (!ramping && !same(&asked, &now)) {
        before = now;
        wanted = asked;
        begun = time;
        ramping = 1;
    }
    if (ramping) {
        const double u = ramp_ns > 0.0 ? (double)(time - begun) / ramp_ns : 1.0;
        if (u >= 1.0) {
            now = wanted;
            ramping = 0;
        } else {
            const double weight = u * u * (3.0 - 2.0 * u);
            now.share = before.share + weight * (wanted.share - before.share);
            for (int i = 0; i < 3; ++i) now.tool[i] = before.tool[i] + weight * (wanted.tool[i] - before.tool[i]);
        }
    }
    *pin->applied = now.share;
    for (int i = 0; i < 3; ++i) *pin->tool[i] = now.tool[i] / mm_per_unit;
    return flags;
}

// --- both directions, mm ---
static unsigned joints_of(const double world[3], double joints[3]) {
    const unsigned status =
        stepdiag_command_at_temperature(compensator, world, now.tool, temperature_in_force(), joints);
    if (now.share < 1.0 && !(status & STEPDIAG_REFUSED))  // refused numbers may be none
        for (int i = 0; i < 3; ++i) joints[i] = world[i] + now.share * (joints[i] - world[i]);
    return status;
}

// For a share s of the correction, the world is the fixed point of world <- joints - s (command(world) - world). The
// slopes of the errors are below 0.1 (tables with larger slopes do not load), so each iteration gains one digit. At the
// edge of the volume, the forward of the full correction may be refused although the world is inside.
static unsigned world_of(const double joints[3], double world[3]) {
    enum { TURNS = 16 };
    const double* const temperature = temperature_in_force();
    unsigned status = stepdiag_forward_at_temperature(compensator, joints, now.tool, temperature, world);
    if (now.share == 1.0) return status;
    if (!isfinite(joints[0]) || !isfinite(joints[1]) || !isfinite(joints[2])) return status;  // they are the world
    if (now.share == 0.0) {
        memcpy(world, joints, 3 * sizeof *world);
        return stepdiag_error_at_temperature(compensator, joints, now.tool, temperature, NULL, NULL);
    }
    for (int i = 0; i < 3; ++i) world[i] = joints[i] + now.share * (world[i] - joints[i]);
    for (int turn = 0; turn < TURNS; ++turn) {
        double command[3], change = 0.0;
        const unsigned inverse = stepdiag_command_at_temperature(compensator, world, now.tool, temperature, command);
        if (inverse & STEPDIAG_REFUSED) break;
        status = inverse;
        for (int i = 0; i < 3; ++i) {
            const double next = joints[i] - now.share * (command[i] - world[i]);
            change = fmax(change, fabs(next - world[i]));
            world[i] = next;
        }
        if (change < 1e-12) break;
    }
    return status;
}

static void publish(const double joints[3], const double world[3], unsigned status) {
    double error[3];
    stepdiag_error_at_temperature(compensator, joints, now.tool, temperature_in_force(), error, NULL);
    for (int i = 0; i < 3; ++i) {
        *pin->error[i] = error[i] / mm_per_unit;
        *pin->correction[i] = status & STEPDIAG_REFUSED ? 0.0 : (joints[i] - world[i]) / mm_per_unit;
    }
    *pin->status = status;
    *pin->inside = !(status & (STEPDIAG_OUTSIDE | STEPDIAG_REFUSED));
}

// --- what LinuxCNC calls ---
static double* coordinate(EmcPose* pose, int axis) {
    double* const all[] = {&pose->tran.x, &pose->tran.y, &pose->tran.z, &pose->a, &pose->b,
                           &pose->c,      &pose->u,      &pose->v,      &pose->w};
    return all[axis];
}

KINEMATICS_TYPE kinematicsType(void) { return KINEMATICS_BOTH; }

int kinematicsForward(const double* joint, EmcPose* pose, const KINEMATICS_FORWARD_FLAGS* fflags,
                      KINEMATICS_INVERSE_FLAGS* iflags) {
    (void)fflags, (void)iflags;
    double joints[3], world[3];
    for (int j = joint_count - 1; j >= 0; --j)
        *coordinate(pose, axis_of_joint[j]) = joint[j];  // of two joints of an axis, the first is used
    for (int i = 0; i < 3; ++i) joints[i] = *coordinate(pose, i) * mm_per_unit;
    const unsigned flags = advance();
    // If the compensator refuses the position, the world is set to the joints. The position remains visible and the
    // machine can be jogged back in joint mode; the inverse refuses moves there in world coordinates.
    const unsigned status = world_of(joints, world) | flags;
    if (!(status & STEPDIAG_REFUSED))
        for (int i = 0; i < 3; ++i) *coordinate(pose, i) = world[i] / mm_per_unit;
    publish(joints, world, status);
    return 0;
}

int kinematicsInverse(const EmcPose* pose, double* joint, const KINEMATICS_INVERSE_FLAGS* iflags,
                      KINEMATICS_FORWARD_FLAGS* fflags) {
    (void)fflags, (void)iflags;
    EmcPose target = *pose;
    if (now.share > 0.0) {
        const double world[3] = {pose->tran.x * mm_per_unit, pose->tran.y * mm_per_unit, pose->tran.z * mm_per_unit};
        double joints[3];
        if (joints_of(world, joints) & STEPDIAG_REFUSED) {
            ++*pin->refusals;
            return -1;
        }
        for (int i = 0; i < 3; ++i) *coordinate(&target, i) = joints[i] / mm_per_unit;
    }
    for (int j = 0; j < joint_count; ++j) joint[j] = *coordinate(&target, axis_of_joint[j]);
    return 0;
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);

// --- loading ---
#include "stepdiagkins_arguments.h"

static int make_pins(void) {
    static const char axis[] = "xyz";
    pin = hal_malloc(sizeof *pin);
    if (!pin) return -1;
    int bad = 0;
    bad |= hal_pin_bit_newf(HAL_IN, &pin->enable, component, "stepdiagkins.enable");
    bad |= hal_pin_bit_newf(HAL_IN, &pin->use_tool, component, "stepdiagkins.use-tool");
    bad |= hal_pin_bit_newf(HAL_OUT, &pin->inside, component, "stepdiagkins.inside");
    bad |= hal_pin_float_newf(HAL_OUT, &pin->applied, component, "stepdiagkins.applied");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->status, component, "stepdiagkins.status");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->refusals, component, "stepdiagkins.refusals");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->table_id_low, component, "stepdiagkins.table-id-low");
    bad |= hal_pin_u32_newf(HAL_OUT, &pin->table_id_high, component, "stepdiagkins.table-id-high");
    for (int i = 0; i < 3; ++i) {
        bad |= hal_pin_float_newf(HAL_IN, &pin->tool_offset[i], component, "stepdiagkins.tooloffset-%c", axis[i]);
        bad |= hal_pin_float_newf(HAL_OUT, &pin->tool[i], component, "stepdiagkins.tool-%c", axis[i]);
        bad |= hal_pin_float_newf(HAL_OUT, &pin->error[i], component, "stepdiagkins.error-%c", axis[i]);
        bad |= hal_pin_float_newf(HAL_OUT, &pin->correction[i], component, "stepdiagkins.correction-%c", axis[i]);
    }
    if (!takes_temperatures) return bad ? -1 : 0;
    bad |= hal_pin_bit_newf(HAL_IN, &pin->temperature_enable, component, "stepdiagkins.temperature-enable");
    bad |= hal_pin_bit_newf(HAL_OUT, &pin->temperature_fault, component, "stepdiagkins.temperature-fault");
    for (int i = 0; i < 3; ++i) {
        bad |= hal_pin_float_newf(HAL_IN, &pin->temperature[i], component, "stepdiagkins.temperature-%c", axis[i]);
        bad |= hal_pin_float_newf(HAL_OUT, &pin->temperature_applied[i], component,
                                  "stepdiagkins.temperature-applied-%c", axis[i]);
    }
    return bad ? -1 : 0;
}

void rtapi_app_exit(void) {
    if (component >= 0) hal_exit(component);
    stepdiag_compensator_free(compensator);
    component = -1;
    compensator = NULL;
}

int rtapi_app_main(void) {
    if (read_arguments()) return -EINVAL;
    component = hal_init("stepdiagkins");
    if (component < 0 || make_pins()) {
        rtapi_app_exit();
        return -ENOMEM;
    }
    const uint64_t id = stepdiag_fingerprint(compensator);
    *pin->enable = 1;
    *pin->table_id_low = (hal_u32_t)(id & 0xffffffffu);
    *pin->table_id_high = (hal_u32_t)(id >> 32);
    memcpy(now.tool, own_tool, sizeof now.tool);
    now.share = 1.0;
    for (int i = 0; i < 3; ++i) in_force[i] = reference;
    rtapi_print("stepdiagkins: table %s, id %08x%08x, forward of inverse within %.0e mm\n", table, (unsigned)(id >> 32),
                (unsigned)(id & 0xffffffffu), stepdiag_inverse_bound(compensator));
    hal_ready(component);
    return 0;
}
