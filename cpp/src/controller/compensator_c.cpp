#include <cstring>
#include <exception>

#include "stepdiag/controller/compensator.h"
#include "stepdiag/controller/compensator.hpp"

struct stepdiag_compensator {
    stepdiag::Compensator compensator;
};

namespace {

std::array<double, 3> array(const double v[3]) { return {v[0], v[1], v[2]}; }

std::array<double, 3> tool_of(const stepdiag_compensator* c, const double* tool) {
    return tool ? array(tool) : c->compensator.tool();
}

unsigned give(const stepdiag::CompensatedPosition& result, double out[3]) {
    std::memcpy(out, result.position.data(), sizeof result.position);
    return result.status;
}

}  // namespace

extern "C" {

stepdiag_options stepdiag_default_options(void) {
    const stepdiag::CompensatorOptions own;
    return {{0.0, 0.0, 0.0}, int(own.outside), own.margin, own.largest_correction, int(own.approach)};
}

stepdiag_compensator* stepdiag_compensator_load(const char* path, const char* chain, const stepdiag_options* options,
                                                char* message, size_t message_size) {
    const stepdiag_options given = options ? *options : stepdiag_default_options();
    try {
        return new stepdiag_compensator{
            stepdiag::Compensator::load(path, chain,
                                        {array(given.origin), stepdiag::Outside(given.outside), given.margin,
                                         given.largest_correction, stepdiag::CompensatedApproach(given.approach)})};
    } catch (const std::exception& error) {
        if (message && message_size) {
            std::strncpy(message, error.what(), message_size - 1);
            message[message_size - 1] = '\0';
        }
        return nullptr;
    }
}

void stepdiag_compensator_free(stepdiag_compensator* compensator) { delete compensator; }

unsigned stepdiag_error(const stepdiag_compensator* compensator, const double position[3], const double tool[3],
                        double error[3], double orientation[3]) {
    const stepdiag::MachineError result = compensator->compensator.error(array(position), tool_of(compensator, tool));
    std::memcpy(error, result.position.data(), sizeof result.position);
    if (orientation) std::memcpy(orientation, result.orientation.data(), sizeof result.orientation);
    return result.status;
}

unsigned stepdiag_command(const stepdiag_compensator* compensator, const double target[3], const double tool[3],
                          double command[3]) {
    return give(compensator->compensator.command(array(target), tool_of(compensator, tool)), command);
}

unsigned stepdiag_forward(const stepdiag_compensator* compensator, const double command[3], const double tool[3],
                          double actual[3]) {
    return give(compensator->compensator.forward(array(command), tool_of(compensator, tool)), actual);
}

uint64_t stepdiag_fingerprint(const stepdiag_compensator* compensator) {
    return compensator->compensator.fingerprint();
}

double stepdiag_inverse_bound(const stepdiag_compensator* compensator) {
    return compensator->compensator.inverse_bound();
}
}
