#include <windows.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "core/platform.hpp"
#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

constexpr DWORD patience = 2000;                 // ms, for a program that opens a pipe for writing
constexpr int tries = 20;                        // of a rename: virus scanners hold a new file for a moment
constexpr DWORD between_tries = 50;              // ms
constexpr std::size_t longest_plain_path = 240;  // MAX_PATH less a temporary file's ending
constexpr DWORD shared_with_all = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

// Windows says it in the person's language and code page; these are what a person meets.
std::string reason(DWORD error) {
    switch (error) {
        case ERROR_FILE_NOT_FOUND:
        case ERROR_PATH_NOT_FOUND:
        case ERROR_INVALID_NAME: return "No such file or directory";
        case ERROR_ACCESS_DENIED: return "Permission denied";
        case ERROR_SHARING_VIOLATION:
        case ERROR_LOCK_VIOLATION: return "another program has it open";
        case ERROR_DISK_FULL:
        case ERROR_HANDLE_DISK_FULL: return "No space left on device";
        default: return "Windows error " + std::to_string(error);
    }
}

[[noreturn]] void fail(const std::string& path, const char* what, DWORD error) {
    throw InvalidArgument(path + ": " + what + ": " + reason(error));
}

std::wstring wide(const std::string& text) {
    const int size = MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), nullptr, 0);
    std::wstring result(std::size_t(size), L'\0');
    MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), result.data(), size);
    return result;
}

// As Windows takes it: long ones only absolute, with a prefix.
std::wstring system_path(const std::string& path) {
    std::wstring given = wide(path);
    const DWORD size = GetFullPathNameW(given.c_str(), 0, nullptr, nullptr);
    if (size < longest_plain_path || given.rfind(LR"(\\?\)", 0) == 0 || given.rfind(LR"(\\.\)", 0) == 0) return given;
    std::wstring whole(size, L'\0');
    whole.resize(GetFullPathNameW(given.c_str(), size, whole.data(), nullptr));
    return whole.rfind(LR"(\\)", 0) == 0 ? LR"(\\?\UNC)" + whole.substr(1) : LR"(\\?\)" + whole;
}

struct Handle {
    HANDLE it;
    explicit operator bool() const { return it != INVALID_HANDLE_VALUE; }
    bool close() { return CloseHandle(std::exchange(it, INVALID_HANDLE_VALUE)) != 0; }
    explicit Handle(HANDLE handle) : it(handle) {}
    Handle(Handle&& other) noexcept : it(std::exchange(other.it, INVALID_HANDLE_VALUE)) {}
    Handle& operator=(Handle&&) = delete;
    ~Handle() {
        if (*this) CloseHandle(it);
    }
};

bool write_all(const Handle& file, std::string_view text) {
    while (!text.empty()) {
        DWORD written = 0;
        const DWORD part = DWORD(std::min(text.size(), std::size_t(1) << 24));
        if (!WriteFile(file.it, text.data(), part, &written, nullptr) || written == 0) return false;
        text.remove_prefix(written);
    }
    return true;
}

// The target of symbolic links. Writing replaces the target, not the link.
std::wstring linked_file(const std::wstring& path) {
    const DWORD attributes = GetFileAttributesW(path.c_str());
    if (attributes == INVALID_FILE_ATTRIBUTES || (attributes & FILE_ATTRIBUTE_REPARSE_POINT) == 0) return path;
    const Handle file{CreateFileW(path.c_str(), 0, shared_with_all, nullptr, OPEN_EXISTING, 0, nullptr)};
    std::wstring target(32768, L'\0');
    const DWORD size = file ? GetFinalPathNameByHandleW(file.it, target.data(), DWORD(target.size()), 0) : 0;
    return size == 0 || size >= target.size() ? path : target.substr(0, size);
}

// Creates a file beside `target`; returns its handle and name.
std::pair<Handle, std::wstring> open_temporary(const std::wstring& target) {
    static std::atomic<unsigned> counter{0};
    for (;;) {
        std::wstring name = target + L"." + std::to_wstring(GetCurrentProcessId()) + L"-" + std::to_wstring(++counter);
        Handle file{CreateFileW(name.c_str(), GENERIC_WRITE, 0, nullptr, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, nullptr)};
        if (file || GetLastError() != ERROR_FILE_EXISTS) return {std::move(file), std::move(name)};
    }
}

bool rename(const std::wstring& from, const std::wstring& to) {
    for (int i = 0; i < tries; ++i) {
        if (i > 0) Sleep(between_tries);
        if (MoveFileExW(from.c_str(), to.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH)) return true;
        const DWORD error = GetLastError();
        if (error != ERROR_ACCESS_DENIED && error != ERROR_SHARING_VIOLATION) return false;
    }
    return false;
}

bool is_folder(const std::wstring& path) {
    const DWORD attributes = GetFileAttributesW(path.c_str());
    return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
}

}  // namespace

std::string read_bytes(const std::string& path, std::size_t largest) {
    const std::wstring name = system_path(path);
    if (is_folder(name)) throw InvalidArgument(path + ": expected a file, got a folder or a device");
    const Handle file{CreateFileW(name.c_str(), GENERIC_READ, shared_with_all, nullptr, OPEN_EXISTING, 0, nullptr)};
    if (!file) fail(path, "cannot be read", GetLastError());
    const DWORD kind = GetFileType(file.it);
    if (kind != FILE_TYPE_DISK && kind != FILE_TYPE_PIPE)
        throw InvalidArgument(path + ": expected a file, got a folder or a device");
    if (kind == FILE_TYPE_PIPE) {
        const ULONGLONG end = GetTickCount64() + patience;
        DWORD waiting = 0;
        while (PeekNamedPipe(file.it, nullptr, 0, nullptr, &waiting, nullptr) && waiting == 0) {
            if (GetTickCount64() > end)
                throw InvalidArgument(path + ": expected a file, got a pipe into which no program writes");
            Sleep(10);
        }
    }
    std::string text, chunk(1 << 16, '\0');
    for (;;) {
        DWORD count = 0;
        if (!ReadFile(file.it, chunk.data(), DWORD(chunk.size()), &count, nullptr)) {
            if (GetLastError() == ERROR_BROKEN_PIPE) break;  // its writer has closed it
            fail(path, "cannot be read", GetLastError());
        }
        if (count == 0) break;
        text.append(chunk.data(), count);
        if (text.size() > largest) throw InvalidArgument(path + ": larger than 1 GiB");
    }
    return text;
}

void replace_file(const std::string& path, std::string_view content) {
    constexpr const char* what = "cannot be written";
    const std::wstring given = system_path(path);
    const DWORD attributes = GetFileAttributesW(given.c_str());
    const bool exists = attributes != INVALID_FILE_ATTRIBUTES;
    if (is_folder(given)) throw InvalidArgument(path + ": cannot be written: it is a folder");
    if (exists && (attributes & FILE_ATTRIBUTE_READONLY) != 0)
        throw InvalidArgument(path +
                              ": cannot be written: the file is read-only; make it writable, or name another file");
    {  // write to a pipe or a device, such as NUL, do not replace it
        Handle device{CreateFileW(given.c_str(), GENERIC_WRITE, shared_with_all, nullptr, OPEN_EXISTING, 0, nullptr)};
        if (!device && exists) fail(path, what, GetLastError());
        if (device && GetFileType(device.it) != FILE_TYPE_DISK) {
            if (!write_all(device, content)) fail(path, what, GetLastError());
            return;
        }
    }
    const std::wstring target = linked_file(given);
    auto [file, temporary] = open_temporary(target);
    if (!file) fail(path, what, GetLastError());
    const bool written = write_all(file, content) && FlushFileBuffers(file.it);
    DWORD error = written ? 0 : GetLastError();
    if (!file.close() && error == 0) error = GetLastError();
    if (error == 0 && rename(temporary, target)) return;
    if (error == 0) error = GetLastError();
    DeleteFileW(temporary.c_str());
    fail(path, what, error);
}

}  // namespace stepdiag
