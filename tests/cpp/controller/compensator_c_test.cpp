#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "stepdiag/controller/compensator.h"
#include "support/random_machine.hpp"

extern "C" const char* stepdiag_c11_failure(const char* path, const char* chain);
extern "C" const char* stepdiag_trap_failure(const char* path, const char* chain);

namespace stepdiag {
namespace {

std::string written_table() {
    const std::string path = ::testing::TempDir() + "compensator_c_test.csv";
    write_parameter_table(random_table(), path);
    return path;
}

struct Loaded {
    std::string path = written_table();
    stepdiag_compensator* compensator = stepdiag_compensator_load(path.c_str(), "wX'bYZt", nullptr, nullptr, 0);
    ~Loaded() { stepdiag_compensator_free(compensator); }
};

TEST(CompensatorC, ACompilerOfC11TakesItsHeaderAndAProgramInCWorks) {
    EXPECT_STREQ(stepdiag_c11_failure(written_table().c_str(), "wX'bYZt"), nullptr);
}

TEST(CompensatorC, WhatIsNoNumberIsRefusedAndRaisesNoFloatingPointException) {
    ParameterTable table = random_table();
    table.header["temperature_reference_c"] = "20.0";
    table.header["expansion_per_k"] = "1e-05 1.1e-05 1.2e-05";
    const std::string path = ::testing::TempDir() + "traps.csv";
    write_parameter_table(table, path);
    // In a process of its own: a trap ends it.
    const auto end = [&] {
        const char* const failure = stepdiag_trap_failure(path.c_str(), "wX'bYZt");
        if (failure) std::fputs(failure, stderr);
        std::_Exit(failure ? 1 : 0);
    };
    EXPECT_EXIT(end(), ::testing::ExitedWithCode(0), "");
}

TEST(CompensatorC, AnUnverifiedCalibrationIsRefusedUnlessAccepted) {
    ParameterTable table = random_table();
    table.header["method"] = "adjustment";
    table.header[unverified_key] = unverified_because;
    const std::string path = ::testing::TempDir() + "unverified.csv";
    write_parameter_table(table, path);  // with a checksum of its own
    char message[300];
    EXPECT_EQ(stepdiag_compensator_load(path.c_str(), "wX'bYZt", nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::strstr(message, "unverified.csv: unverified: a checksum was absent"), nullptr) << message;
    EXPECT_NE(std::strstr(message, "accept_unverified"), nullptr) << message;
    stepdiag_options options = stepdiag_default_options();
    options.accept_rejected = 1;
    EXPECT_EQ(stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, nullptr, 0), nullptr);
    // What a program compiled for 1.0 may have in its padding.
    options.accept_unverified = 0x5a5a5a5a;
    EXPECT_EQ(stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, nullptr, 0), nullptr);
    options.accept_unverified = 1;
    stepdiag_compensator* compensator = stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, nullptr, 0);
    EXPECT_EQ(stepdiag_is_unverified(compensator), 1);
    stepdiag_compensator_free(compensator);

    const Loaded verified;
    EXPECT_EQ(stepdiag_is_unverified(verified.compensator), 0);
    EXPECT_EQ(stepdiag_is_unverified(nullptr), 0);
}

TEST(CompensatorC, SaysWhatTheCppLibrarySays) {
    const Loaded loaded;
    const Compensator cpp(random_table(), "table", test_chain);
    EXPECT_EQ(stepdiag_fingerprint(loaded.compensator), cpp.fingerprint());
    for (const Position& p : random_positions(100, 10.0)) {
        Position error, orientation, command, actual;
        EXPECT_EQ(stepdiag_error(loaded.compensator, p.data(), nullptr, error.data(), orientation.data()),
                  cpp.error(p, cpp.tool()).status);
        EXPECT_EQ(error, cpp.error(p, cpp.tool()).position);
        EXPECT_EQ(orientation, cpp.error(p, cpp.tool()).orientation);
        stepdiag_command(loaded.compensator, p.data(), nullptr, command.data());
        EXPECT_EQ(command, cpp.command(p, cpp.tool()).position);
        stepdiag_forward(loaded.compensator, command.data(), nullptr, actual.data());
        EXPECT_EQ(actual, cpp.forward(command, cpp.tool()).position);
    }
}

TEST(CompensatorC, WhatIsNotCompensatedIsCounted) {
    ParameterTable table = random_table();
    table.functions[4].reset(), table.squarenesses[2].reset();
    const std::string path = ::testing::TempDir() + "uncompensated.csv";
    write_parameter_table(table, path);
    stepdiag_compensator* compensator = stepdiag_compensator_load(path.c_str(), "wX'bYZt", nullptr, nullptr, 0);
    EXPECT_STREQ(stepdiag_uncompensated(compensator, 0), "EBX");
    EXPECT_STREQ(stepdiag_uncompensated(compensator, 1), "A0Z");
    EXPECT_EQ(stepdiag_uncompensated(compensator, 2), nullptr);
    EXPECT_EQ(stepdiag_uncompensated(nullptr, 0), nullptr);
    stepdiag_compensator_free(compensator);
}

TEST(CompensatorC, ARejectedFitIsRefusedUnlessAccepted) {
    ParameterTable table = random_table();
    table.header["fit"] = "rejected";
    const std::string path = ::testing::TempDir() + "rejected.csv";
    write_parameter_table(table, path);
    char message[300];
    EXPECT_EQ(stepdiag_compensator_load(path.c_str(), "wX'bYZt", nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::strstr(message, "fit=rejected"), nullptr) << message;
    stepdiag_options options = stepdiag_default_options();
    options.accept_rejected = 1;
    stepdiag_compensator* compensator = stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, nullptr, 0);
    EXPECT_STREQ(stepdiag_fit(compensator), "rejected");
    stepdiag_compensator_free(compensator);

    const Loaded without;
    EXPECT_STREQ(stepdiag_fit(without.compensator), "");
    EXPECT_STREQ(stepdiag_fit(nullptr), "");
}

TEST(CompensatorC, TheAnswerMayReplaceTheQuestion) {
    const Loaded loaded;
    double p[3] = {100.0, 200.0, 300.0}, separate[3];
    stepdiag_command(loaded.compensator, p, nullptr, separate);
    stepdiag_command(loaded.compensator, p, nullptr, p);
    EXPECT_EQ(std::memcmp(p, separate, sizeof p), 0);
}

TEST(CompensatorC, ManyAtOnceHaveTheBitsOfCpp) {
    const Loaded loaded;
    const Compensator compensator = Compensator::load(loaded.path, "wX'bYZt");
    const std::vector<Position> asked = random_positions(11, 10.0);
    const double tool[3] = {1.0, 2.0, 3.0};
    double c[33], cpp[33], turns[33];
    unsigned statuses[11], statuses_cpp[11];
    EXPECT_EQ(stepdiag_errors(loaded.compensator, 11, asked[0].data(), tool, nullptr, c, turns, statuses),
              compensator.errors(11, asked[0].data(), tool, nullptr, cpp, nullptr, statuses_cpp));
    EXPECT_EQ(std::memcmp(c, cpp, sizeof c), 0);
    EXPECT_EQ(std::memcmp(statuses, statuses_cpp, sizeof statuses), 0);
    EXPECT_EQ(stepdiag_commands(loaded.compensator, 11, asked[0].data(), tool, nullptr, c, statuses),
              compensator.commands(11, asked[0].data(), tool, nullptr, cpp, statuses_cpp));
    EXPECT_EQ(std::memcmp(c, cpp, sizeof c), 0);
    EXPECT_EQ(std::memcmp(statuses, statuses_cpp, sizeof statuses), 0);
}

TEST(CompensatorC, NullIsRefusedAndNeverFollowed) {
    const Loaded loaded;
    char message[300];
    EXPECT_EQ(stepdiag_compensator_load(nullptr, "wX'bYZt", nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::strstr(message, "path"), nullptr);
    EXPECT_EQ(stepdiag_compensator_load(loaded.path.c_str(), nullptr, nullptr, message, sizeof message), nullptr);
    EXPECT_NE(std::strstr(message, "chain"), nullptr);
    EXPECT_EQ(stepdiag_compensator_load(nullptr, nullptr, nullptr, nullptr, 300), nullptr);

    const double p[3] = {1.0, 2.0, 3.0};
    double out[3];
    EXPECT_EQ(stepdiag_error(nullptr, p, nullptr, out, out), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_command(nullptr, p, nullptr, out), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_forward(nullptr, p, nullptr, out), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_error(loaded.compensator, nullptr, nullptr, out, out), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_command(loaded.compensator, nullptr, nullptr, out), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_error(loaded.compensator, p, nullptr, nullptr, nullptr), 0u);
    EXPECT_EQ(stepdiag_forward(loaded.compensator, p, nullptr, nullptr), 0u);
    EXPECT_EQ(stepdiag_errors(nullptr, 1, p, nullptr, nullptr, out, nullptr, nullptr), unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_commands(loaded.compensator, 1, p, nullptr, nullptr, nullptr, nullptr),
              unsigned(STEPDIAG_REFUSED));
    EXPECT_EQ(stepdiag_fingerprint(nullptr), 0u);
    EXPECT_EQ(stepdiag_inverse_bound(nullptr), 0.0);
    stepdiag_compensator_free(nullptr);
}

TEST(CompensatorC, AMessageIsCutToItsPlace) {
    for (const size_t size : {size_t(0), size_t(1), size_t(2), size_t(20)}) {
        char message[24];
        std::memset(message, '#', sizeof message);
        EXPECT_EQ(stepdiag_compensator_load("/nowhere/at/all.csv", "wX'bYZt", nullptr, message, size), nullptr);
        for (size_t i = size; i < sizeof message; ++i) EXPECT_EQ(message[i], '#');
        if (size > 0) {
            EXPECT_EQ(std::strlen(message), size - 1);
        }
    }
}

TEST(CompensatorC, OptionsOutOfTheirRangeAreRefused) {
    char message[300];
    for (const int bad : {-1, 3, 12345}) {
        stepdiag_options options = stepdiag_default_options();
        options.outside = bad;
        EXPECT_EQ(stepdiag_compensator_load(written_table().c_str(), "wX'bYZt", &options, message, sizeof message),
                  nullptr);
        EXPECT_NE(std::strstr(message, "outside"), nullptr);
    }
    stepdiag_options options = stepdiag_default_options();
    options.origin[2] = NAN;
    EXPECT_EQ(stepdiag_compensator_load(written_table().c_str(), "wX'bYZt", &options, message, sizeof message),
              nullptr);
    EXPECT_NE(std::strstr(message, "origin"), nullptr);
}

}  // namespace
}  // namespace stepdiag
