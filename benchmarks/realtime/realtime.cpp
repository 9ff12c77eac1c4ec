// Tests whether the compensator is suitable for a real-time thread. The program loads a table, locks its memory, and
// selects the scheduler SCHED_FIFO if permitted. It then makes CALLS calls of stepdiag_error, _command and _forward at
// random positions, and as many answers of stepdiag_errors and _commands for many positions, and checks that there is
//   - no allocation: malloc and its variants are hooked;
//   - no page fault: getrusage before and after;
//   - no system call: seccomp's strict mode kills the program for calls other than read, write and _exit; the program
//     returns its results by one write.
// It also checks all results: forward(command(t)) is t. It reports the times of single calls without assessing them,
// because they depend on the computer and its load.
#include <fcntl.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "malloc_hook.hpp"
#include "stepdiag/controller/compensator.h"
#include "stepdiag/machine/error_map.hpp"

namespace {

using Position = std::array<double, 3>;

// Results of a run, in a plain structure that a child process can write to its parent.
struct Findings {
    long allocations, minor_faults, major_faults;
    double largest_residual;          // mm
    long wrong;                       // number of statuses other than 0
    double seconds, longest;          // time of all calls, time of the longest call
    std::array<long, 5> slower_than;  // number of calls above 0.2, 1, 10, 100, 1000 us
};
constexpr std::array<double, 5> limits = {0.2e-6, 1e-6, 10e-6, 100e-6, 1000e-6};

// Uses the vDSO without a system call. It reads the time stamp counter, which strict mode forbids.
double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::string write_table(const std::string& path) {
    const Eigen::Vector3d volume(800.0, 600.0, 500.0);
    stepdiag::ParameterTable table = stepdiag::make_random_error_map(volume, {}).table();
    table.header = {
        {"chain", "[w X' b Y Z t]"}, {"volume_mm", stepdiag::format_lengths(volume)}, {"tool_mm", "0.0 0.0 120.0"}};
    table.header["temperature_reference_c"] = "20.0";
    table.header["expansion_per_k"] = "1.15e-05 1.15e-05 8e-06";
    stepdiag::write_parameter_table(table, path);
    return path;
}

// Makes `count` calls, a third of each kind, every other pair with temperatures. This function must not touch memory
// for the first time.
template <bool timed>
void call(const stepdiag_compensator* compensator, const std::vector<Position>& targets, long count,
          Findings& findings) {
    const double tool[3] = {10.0, -20.0, 150.0}, warm[3] = {24.0, 31.5, 18.0};
    double error[3], orientation[3], command[3], actual[3];
    for (long i = 0; 3 * i < count; ++i) {
        const double* target = targets[std::size_t(i) % targets.size()].data();
        const double* const temperature = i % 4 < 2 ? warm : nullptr;
        const double start = timed ? now() : 0.0;
        unsigned status =
            stepdiag_command_at_temperature(compensator, target, i % 2 ? tool : nullptr, temperature, command);
        const double middle = timed ? now() : 0.0;
        status |= stepdiag_error_at_temperature(compensator, command, i % 2 ? tool : nullptr, temperature, error,
                                                orientation);
        status |= stepdiag_forward_at_temperature(compensator, command, i % 2 ? tool : nullptr, temperature, actual);
        const double took = timed ? std::max(middle - start, 0.5 * (now() - middle)) : 0.0;
        findings.wrong += status != 0;
        for (int a = 0; a < 3; ++a)
            findings.largest_residual = std::max(findings.largest_residual, std::abs(actual[a] - target[a]));
        findings.longest = std::max(findings.longest, took);
        for (std::size_t k = 0; k < limits.size(); ++k) findings.slower_than[k] += took > limits[k];
    }
}

// The same by calls for `block` positions at a time. The commands' forwards are the targets.
constexpr std::size_t block = 50;
void call_for_many(const stepdiag_compensator* compensator, const std::vector<Position>& targets, long count,
                   Findings& findings) {
    const double tool[3] = {10.0, -20.0, 150.0}, warm[3] = {24.0, 31.5, 18.0};
    double errors[3 * block], orientations[3 * block], commands[3 * block], actual[3];
    unsigned statuses[block];
    for (long i = 0; 2 * i * long(block) < count; ++i) {
        const double* some = targets[std::size_t(i) * block % (targets.size() - block)].data();
        const double* const temperature = i % 4 < 2 ? warm : nullptr;
        unsigned status = stepdiag_commands(compensator, block, some, tool, temperature, commands, statuses);
        status |= stepdiag_errors(compensator, block, commands, tool, temperature, errors, orientations, statuses);
        findings.wrong += status != 0;
        for (std::size_t k = 0; k < block; ++k) {
            stepdiag_forward_at_temperature(compensator, commands + 3 * k, tool, temperature, actual);
            for (std::size_t a = 0; a < 3; ++a)
                findings.largest_residual = std::max(findings.largest_residual, std::abs(actual[a] - some[3 * k + a]));
        }
    }
}

// Makes the calls in a separate process. seccomp kills it if one of them is a system call.
void measure(const stepdiag_compensator* compensator, const std::vector<Position>& targets, long count, bool strict,
             int out) {
    Findings warm = {}, findings = {};
    call<true>(compensator, targets, 3 * long(targets.size()), warm);
    call_for_many(compensator, targets, 4 * long(targets.size()), warm);
    rusage before = {}, after = {};
    getrusage(RUSAGE_SELF, &after);  // first call loads its own pages
    getrusage(RUSAGE_SELF, &before);
    const long allocations = allocation_calls();
    const double start = now();
    if (!strict) call<true>(compensator, targets, count, findings);
    else if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) == 0) call<false>(compensator, targets, count, findings);
    else _exit(3);
    call_for_many(compensator, targets, count, findings);
    if (!strict) findings.seconds = now() - start;
    findings.allocations = allocation_calls() - allocations;
    if (!strict) {
        getrusage(RUSAGE_SELF, &after);
        findings.minor_faults = after.ru_minflt - before.ru_minflt;
        findings.major_faults = after.ru_majflt - before.ru_majflt;
    }
    const bool written = write(out, &findings, sizeof findings) == ssize_t(sizeof findings);
    syscall(SYS_exit, written ? 0 : 4);  // strict mode does not permit exit_group
}

// Runs one test in a child process. Page faults and system calls need separate runs, because getrusage is a system
// call.
bool run(const stepdiag_compensator* compensator, const std::vector<Position>& targets, long count, bool strict,
         Findings& findings, int& status) {
    int ends[2];
    if (pipe(ends) != 0) return false;
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        // A child does not inherit locked memory.
        if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) std::fprintf(stderr, "mlockall: %s\n", std::strerror(errno));
        measure(compensator, targets, count, strict, ends[1]);
    }
    close(ends[1]);
    const bool read_all = child > 0 && read(ends[0], &findings, sizeof findings) == ssize_t(sizeof findings);
    close(ends[0]);
    return child > 0 && waitpid(child, &status, 0) == child && read_all && WIFEXITED(status) &&
           WEXITSTATUS(status) == 0;
}

// Checks that strict mode kills a process that makes a system call.
bool is_a_system_call_deadly() {
    const pid_t child = fork();
    if (child == 0) {
        if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) == 0) getppid();
        _exit(0);
    }
    int status = 0;
    return child > 0 && waitpid(child, &status, 0) == child && WIFSIGNALED(status);
}

std::string scheduling() {
    sched_param parameter = {};
    parameter.sched_priority = 80;
    if (sched_setscheduler(0, SCHED_FIFO, &parameter) == 0) return "SCHED_FIFO, priority 80";
    return std::string("not real-time: SCHED_FIFO: ") + std::strerror(errno);
}

}  // namespace

int main(int count, char** arguments) {
    const long calls = count > 1 ? std::atol(arguments[1]) : 10'000'000;
    const std::string path = write_table((count > 2 ? std::string(arguments[2]) : std::string("/tmp")) + "/realtime-" +
                                         std::to_string(getpid()) + ".csv");
    char message[300] = "";
    stepdiag_options options = stepdiag_default_options();
    options.temperatures[0] = 5.0, options.temperatures[1] = 40.0;
    stepdiag_compensator* compensator =
        stepdiag_compensator_load(path.c_str(), "wX'bYZt", &options, message, sizeof message);
    unlink(path.c_str());
    if (!compensator || calls < 1) {
        std::fprintf(stderr, "realtime: %s\n", compensator ? "usage: realtime [CALLS [FOLDER]]" : message);
        return 2;
    }
    const bool is_counting = allocation_calls() > 100;  // loading a table makes more than 100
    std::mt19937_64 engine(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Position> targets(10'000);
    for (Position& p : targets) p = {800.0 * unit(engine), 600.0 * unit(engine), 500.0 * unit(engine)};

    std::printf("%ld calls of stepdiag_command, _error, _forward, and as many answers of _commands, _errors; %s\n",
                calls, scheduling().c_str());
    std::fflush(stdout);
    bool good = true;
    const auto expect = [&](bool holds, const char* claim) {
        std::printf("%s: %s\n", holds ? "ok" : "FAILED", claim);
        good &= holds;
    };
    Findings findings = {};
    int status = 0;
    expect(run(compensator, targets, calls, false, findings, status), "all calls return, memory locked");
    std::printf("  %.1f s; allocations and frees %ld, minor page faults %ld, major %ld; largest residual %.1e mm\n",
                findings.seconds, findings.allocations, findings.minor_faults, findings.major_faults,
                findings.largest_residual);
    std::printf("  calls longer than 0.2, 1, 10, 100, 1000 us: %ld %ld %ld %ld %ld of %ld; longest %.1f us\n",
                findings.slower_than[0], findings.slower_than[1], findings.slower_than[2], findings.slower_than[3],
                findings.slower_than[4], calls / 3, 1e6 * findings.longest);
    expect(is_counting && findings.allocations == 0, "no allocation, by a hook that counts");
    expect(findings.minor_faults == 0 && findings.major_faults == 0, "no page fault");
    expect(findings.wrong == 0, "every status is 0");
    expect(findings.largest_residual <= stepdiag_inverse_bound(compensator),
           "every forward of a command is its target");
    findings = {};
    const bool strict = run(compensator, targets, calls, true, findings, status);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 3) {
        std::printf("not shown: seccomp is not permitted here\n");
    } else {
        expect(strict && is_a_system_call_deadly(), "no system call, in seccomp's strict mode, where one is deadly");
        expect(findings.allocations == 0 && findings.wrong == 0, "and the same answers there");
    }
    stepdiag_compensator_free(compensator);
    return good ? 0 : 1;
}
