// Distributes items of work over several threads. Internal.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

int thread_count(const RunControl& control, std::uint64_t items);

// Communication between the working threads and the waiting thread.
struct Progress {
    std::atomic<bool> stop{false};     // start no further item
    std::atomic<bool> abandon{false};  // abandon the item in progress
    std::atomic<std::uint64_t> done{0};
};
// Processes one item, and counts completed leaves in progress.done.
using Work = std::function<void(std::uint64_t item, Progress& progress)>;

// Each thread calls `make_work(thread)` once. Exceptions from any thread and from go_on are passed to the caller.
void work_through(std::uint64_t items, const RunControl& control, const std::function<Work(int thread)>& make_work);

}  // namespace stepdiag
