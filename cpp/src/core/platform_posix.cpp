#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "core/platform.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr int patience = 2000;  // ms, for a program that opens a pipe for writing

struct ReadableFile {
    int handle;
    ~ReadableFile() {
        if (handle >= 0) ::close(handle);
    }
};

bool write_all(int file, std::string_view text) {
    while (!text.empty()) {
        const auto count = ::write(file, text.data(), text.size());
        if (count <= 0) return false;
        text.remove_prefix(std::size_t(count));
    }
    return true;
}

// The target of symbolic links, whether it exists or not. Writing replaces the target, not the link.
std::string linked_file(const std::string& path) {
    std::filesystem::path file = path;
    std::error_code error;
    for (int links = 0; links < 40; ++links) {
        const auto next = std::filesystem::read_symlink(file, error);
        if (error) return file.string();
        file = file.parent_path() / next;
    }
    return path;
}

// Creates a file beside `target` with default permissions; returns its descriptor (-1 on failure) and its name. mkstemp
// is no alternative: it sets other permissions, and reading the umask to correct them changes it for other threads.
std::pair<int, std::string> open_temporary(const std::string& target) {
    static std::atomic<unsigned> counter{0};
    for (;;) {
        const std::string name = target + "." + std::to_string(::getpid()) + "-" + std::to_string(++counter);
        const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file >= 0 || errno != EEXIST) return {file, name};
    }
}

// So that the name of a new file survives a power cut.
bool sync_folder(const std::filesystem::path& folder) {
    const int handle = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (handle < 0) return errno == EACCES;                       // a folder that may be written but not read
    const bool synced = ::fsync(handle) == 0 || errno == EINVAL;  // a file system that has nothing to sync
    const int error = errno;
    ::close(handle);
    errno = error;
    return synced;
}

}  // namespace

std::string read_bytes(const std::string& path, std::size_t largest) {
    const auto fail = [&] { throw InvalidArgument(path + ": cannot be read: " + std::strerror(errno)); };
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0) fail();
    if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode))
        throw InvalidArgument(path + ": expected a file, got a folder or a device");
    // The opening of a pipe without a writer blocks without O_NONBLOCK.
    const ReadableFile file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
    if (file.handle < 0) fail();
    pollfd polled = {file.handle, POLLIN, 0};
    const bool is_ready = !S_ISFIFO(status.st_mode) || ::poll(&polled, 1, patience) != 0;
    std::string text;
    std::vector<char> chunk(1 << 16);
    for (;;) {
        const ssize_t count = ::read(file.handle, chunk.data(), chunk.size());
        if (count < 0 && errno == EAGAIN) {  // a writer that takes its time
            if (::fcntl(file.handle, F_SETFL, ::fcntl(file.handle, F_GETFL) & ~O_NONBLOCK) != 0) fail();
            continue;
        }
        if (count < 0 && errno != EINTR) fail();
        if (count == 0 && text.empty() && !is_ready)
            throw InvalidArgument(path + ": expected a file, got a pipe into which no program writes");
        if (count == 0) break;
        if (count > 0) text.append(chunk.data(), std::size_t(count));
        if (text.size() > largest) throw InvalidArgument(path + ": larger than 1 GiB");
    }
    return text;
}

void replace_file(const std::string& path, std::string_view text) {
    const auto fail = [&](const std::string& what) {
        throw InvalidArgument(path + ": " + what + ": " + std::strerror(errno));
    };
    struct stat status = {};
    const bool exists = ::stat(path.c_str(), &status) == 0;
    if (!exists && errno != ENOENT) fail("cannot be written");
    if (exists && S_ISDIR(status.st_mode)) throw InvalidArgument(path + ": cannot be written: it is a folder");
    if (exists && !S_ISREG(status.st_mode)) {  // write to a pipe or a device, do not replace it
        const int file = ::open(path.c_str(), O_WRONLY);
        const bool written = file >= 0 && write_all(file, text);
        if (file < 0 || ::close(file) != 0 || !written) fail("cannot be written");
        return;
    }
    // Renaming would replace it all the same; so would root, who may write everything: it is the mode that counts.
    if (exists && ((status.st_mode & 0222) == 0 || ::access(path.c_str(), W_OK) != 0))
        throw InvalidArgument(path +
                              ": cannot be written: the file is read-only; make it writable, or name another file");
    const std::string target = linked_file(path);
    const auto [file, temporary] = open_temporary(target);
    if (file < 0) fail("cannot be written");
    const bool written =
        write_all(file, text) && (!exists || ::fchmod(file, status.st_mode & 07777) == 0) && ::fsync(file) == 0;
    if (::close(file) != 0 || !written || ::rename(temporary.c_str(), target.c_str()) != 0) {
        const int error = errno;
        ::unlink(temporary.c_str());
        errno = error;
        fail("cannot be written");
    }
    if (!sync_folder(std::filesystem::path(target).parent_path())) fail("cannot be written");
}

}  // namespace stepdiag
