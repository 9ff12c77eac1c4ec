#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>

#include "stepdiag/controller/compensator.h"
#include "stepdiag/controller/compensator.hpp"
#include "stepdiag/core/error.hpp"

struct stepdiag_compensator {
    stepdiag::Compensator compensator;
};

namespace {

using stepdiag::Compensator;
using stepdiag::InvalidArgument;

static_assert(int(stepdiag::Outside::hold) == STEPDIAG_HOLD && int(stepdiag::Outside::linear) == STEPDIAG_LINEAR &&
              int(stepdiag::Outside::refuse) == STEPDIAG_REFUSE);
static_assert(int(stepdiag::CompensatedApproach::mean) == STEPDIAG_MEAN &&
              int(stepdiag::CompensatedApproach::positive) == STEPDIAG_POSITIVE &&
              int(stepdiag::CompensatedApproach::negative) == STEPDIAG_NEGATIVE);
static_assert(int(stepdiag::compensation_outside) == STEPDIAG_OUTSIDE &&
              int(stepdiag::compensation_capped) == STEPDIAG_CAPPED &&
              int(stepdiag::compensation_refused) == STEPDIAG_REFUSED &&
              int(stepdiag::compensation_temperature) == STEPDIAG_TEMPERATURE);

// accept_unverified has the place of padding in 1.0, so that programs compiled for 1.0 still run.
static_assert(alignof(double) != 8 ||
              (sizeof(stepdiag_options) == 88 && offsetof(stepdiag_options, temperatures) == 72));

std::array<double, 3> array(const double v[3]) { return {v[0], v[1], v[2]}; }

stepdiag::CompensatorOptions options_of(const stepdiag_options& given) {
    return {array(given.origin),
            stepdiag::Outside(given.outside),
            given.margin,
            given.largest_correction,
            stepdiag::CompensatedApproach(given.approach),
            given.largest_tool,
            given.accept_rejected != 0,
            given.accept_unverified == 1,  // of programs compiled before it was there, anything
            {given.temperatures[0], given.temperatures[1]}};
}

stepdiag_compensator* load(const char* path, const char* chain, const stepdiag_options* options) {
    if (!path) throw InvalidArgument("path: expected the name of a file, got NULL");
    if (!chain) throw InvalidArgument("chain: expected a text such as \"wX'bYZt\", got NULL");
    return new stepdiag_compensator{
        Compensator::load(path, chain, options_of(options ? *options : stepdiag_default_options()))};
}

void tell(const char* reason, char* message, size_t size) noexcept {
    if (!message || size == 0) return;
    const size_t length = std::min(std::strlen(reason), size - 1);
    std::memcpy(message, reason, length);
    message[length] = '\0';
}

// Replaces null output pointers.
struct Scratch {
    double numbers[3];
    double* or_else(double* out) noexcept { return out ? out : numbers; }
};

}  // namespace

extern "C" {

stepdiag_options stepdiag_default_options(void) {
    const stepdiag::CompensatorOptions own;
    return {{own.origin[0], own.origin[1], own.origin[2]},
            int(own.outside),
            own.margin,
            own.largest_correction,
            int(own.approach),
            own.largest_tool,
            own.accept_rejected,
            own.accept_unverified,
            {own.temperatures[0], own.temperatures[1]}};
}

stepdiag_compensator* stepdiag_compensator_load(const char* path, const char* chain, const stepdiag_options* options,
                                                char* message, size_t message_size) {
    try {
        return load(path, chain, options);
    } catch (const std::exception& error) {
        tell(error.what(), message, message_size);
    } catch (...) {
        tell("an unknown exception", message, message_size);
    }
    return nullptr;
}

void stepdiag_compensator_free(stepdiag_compensator* compensator) { delete compensator; }

unsigned stepdiag_error_at_temperature(const stepdiag_compensator* compensator, const double position[3],
                                       const double tool[3], const double temperature[3], double error[3],
                                       double orientation[3]) {
    if (!compensator || !position) return STEPDIAG_REFUSED;
    Scratch scratch;
    return compensator->compensator.error(position, tool, temperature, scratch.or_else(error), orientation);
}

unsigned stepdiag_command_at_temperature(const stepdiag_compensator* compensator, const double target[3],
                                         const double tool[3], const double temperature[3], double command[3]) {
    if (!compensator || !target) return STEPDIAG_REFUSED;
    Scratch scratch;
    return compensator->compensator.command(target, tool, temperature, scratch.or_else(command));
}

unsigned stepdiag_forward_at_temperature(const stepdiag_compensator* compensator, const double command[3],
                                         const double tool[3], const double temperature[3], double actual[3]) {
    if (!compensator || !command) return STEPDIAG_REFUSED;
    Scratch scratch;
    return compensator->compensator.forward(command, tool, temperature, scratch.or_else(actual));
}

unsigned stepdiag_error(const stepdiag_compensator* compensator, const double position[3], const double tool[3],
                        double error[3], double orientation[3]) {
    return stepdiag_error_at_temperature(compensator, position, tool, nullptr, error, orientation);
}

unsigned stepdiag_command(const stepdiag_compensator* compensator, const double target[3], const double tool[3],
                          double command[3]) {
    return stepdiag_command_at_temperature(compensator, target, tool, nullptr, command);
}

unsigned stepdiag_forward(const stepdiag_compensator* compensator, const double command[3], const double tool[3],
                          double actual[3]) {
    return stepdiag_forward_at_temperature(compensator, command, tool, nullptr, actual);
}

unsigned stepdiag_errors(const stepdiag_compensator* compensator, size_t count, const double* positions,
                         const double tool[3], const double temperature[3], double* errors, double* orientations,
                         unsigned* statuses) {
    if (!compensator || !positions || !errors) return STEPDIAG_REFUSED;
    return compensator->compensator.errors(count, positions, tool, temperature, errors, orientations, statuses);
}

unsigned stepdiag_commands(const stepdiag_compensator* compensator, size_t count, const double* targets,
                           const double tool[3], const double temperature[3], double* commands, unsigned* statuses) {
    if (!compensator || !targets || !commands) return STEPDIAG_REFUSED;
    return compensator->compensator.commands(count, targets, tool, temperature, commands, statuses);
}

uint64_t stepdiag_fingerprint(const stepdiag_compensator* compensator) {
    return compensator ? compensator->compensator.fingerprint() : 0;
}

double stepdiag_inverse_bound(const stepdiag_compensator* compensator) {
    return compensator ? compensator->compensator.inverse_bound() : 0.0;
}

double stepdiag_temperature_reference(const stepdiag_compensator* compensator) {
    return compensator ? compensator->compensator.temperature_reference() : NAN;
}

void stepdiag_calibration_tool(const stepdiag_compensator* compensator, double tool[3]) {
    if (!tool) return;
    const auto own = compensator ? compensator->compensator.tool() : std::array<double, 3>{};
    std::copy(own.begin(), own.end(), tool);
}

const char* stepdiag_fit(const stepdiag_compensator* compensator) {
    return compensator ? compensator->compensator.fit().c_str() : "";
}

int stepdiag_is_unverified(const stepdiag_compensator* compensator) {
    return compensator && compensator->compensator.is_unverified();
}

const char* stepdiag_uncompensated(const stepdiag_compensator* compensator, size_t index) {
    if (!compensator || index >= compensator->compensator.uncompensated().size()) return nullptr;
    return compensator->compensator.uncompensated()[index].c_str();
}
}
