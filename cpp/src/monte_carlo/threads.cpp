#include "monte_carlo/threads.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "stepdiag/core/error.hpp"

namespace stepdiag {

int thread_count(const RunControl& control, std::uint64_t items) {
    if (control.threads < 0)
        throw InvalidArgument("threads: expected 0 (as many as there are processors) or more, got " +
                              std::to_string(control.threads));
    const auto threads = control.threads > 0 ? unsigned(control.threads) : std::thread::hardware_concurrency();
    return int(std::clamp<std::uint64_t>(items, 1, std::max(threads, 1u)));
}

void work_through(std::uint64_t items, const RunControl& control, const std::function<Work(int thread)>& make_work) {
    constexpr auto pause = std::chrono::milliseconds(100);  // between calls of go_on
    Progress progress;
    std::atomic<std::uint64_t> next{0};
    std::mutex mutex;
    std::condition_variable ended;
    int running = thread_count(control, items);
    std::exception_ptr failure;

    const auto of_thread = [&](int thread) {
        std::exception_ptr own;
        try {
            const Work work = make_work(thread);
            for (std::uint64_t item; !progress.stop && (item = next++) < items;) work(item, progress);
        } catch (...) {
            own = std::current_exception();
            progress.stop = progress.abandon = true;
        }
        const std::lock_guard lock(mutex);
        if (own && !failure) failure = own;
        --running;
        ended.notify_one();
    };
    std::vector<std::thread> threads;
    const auto join = [&] {
        for (std::thread& thread : threads) thread.join();
    };
    try {
        for (int thread = 0, count = running; thread < count; ++thread) threads.emplace_back(of_thread, thread);
        std::unique_lock lock(mutex);
        while (!ended.wait_for(lock, pause, [&] { return running == 0; })) {
            if (!control.go_on || progress.abandon) continue;
            lock.unlock();
            if (!control.go_on(progress.done)) progress.stop = true;
            lock.lock();
        }
    } catch (...) {
        progress.stop = progress.abandon = true;
        join();
        throw;
    }
    join();
    if (failure) std::rethrow_exception(failure);
    if (control.go_on && !progress.stop) control.go_on(progress.done);
}

}  // namespace stepdiag
