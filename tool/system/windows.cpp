// SPDX-License-Identifier: MIT
#include "tool/system/system.hpp"

#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>

#include <fcntl.h>
#include <io.h>
#include <shellapi.h>
#include <sys/stat.h>
#include <sys/types.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "tool/system/random_letters.hpp"

namespace jostle_system {

namespace {

[[noreturn]] void fail(int error)
{
    throw std::system_error(error, std::generic_category());
}

std::string to_utf8(std::wstring_view text)
{
    const int most = static_cast<int>(text.size());
    std::string result(static_cast<std::size_t>(most) * 3, '\0'); // more than that no UTF-16 unit takes
    const int size = WideCharToMultiByte(CP_UTF8, 0, text.data(), most, result.data(),
                                         static_cast<int>(result.size()), nullptr, nullptr);
    result.resize(static_cast<std::size_t>(size));
    return result;
}

std::wstring from_utf8(std::string_view text)
{
    const int bytes = static_cast<int>(text.size());
    std::wstring result(text.size(), L'\0');
    const int size =
        MultiByteToWideChar(CP_UTF8, 0, text.data(), bytes, result.data(), static_cast<int>(result.size()));
    result.resize(static_cast<std::size_t>(size));
    return result;
}

/// What system calls move at a time: the C library counts in 32 bits, and consoles take no more than this.
constexpr std::size_t largest_piece = std::size_t{1} << 15;

/// As programs take their command line apart: quotes around each word, backslashes doubled before a quote.
void append_quoted(std::wstring& line, std::wstring_view word)
{
    line += line.empty() ? L"\"" : L" \"";
    std::size_t backslashes = 0;
    for (const wchar_t c : word) {
        if (c == L'"') line.append(backslashes + 1, L'\\');
        backslashes = c == L'\\' ? backslashes + 1 : 0;
        line += c;
    }
    line.append(backslashes, L'\\');
    line += L'"';
}

struct Handle
{
    HANDLE handle = nullptr;
    ~Handle()
    {
        if (handle != nullptr) CloseHandle(handle);
    }
};

} // namespace

std::vector<std::string> start(int, char**)
{
    // As text, a line's end would be two bytes, and byte 26 the end of a file.
    for (const int stream : {0, 1, 2})
        _setmode(stream, _O_BINARY);
    // The console belongs to others as well: it is told what bytes mean here until this program ends.
    static const UINT before = GetConsoleOutputCP();
    if (before != 0 && before != CP_UTF8 && SetConsoleOutputCP(CP_UTF8) != 0)
        std::atexit([] { SetConsoleOutputCP(before); });
    // Those of main() have lost what the system's old code page can't say.
    int count = 0;
    LPWSTR* const words = CommandLineToArgvW(GetCommandLineW(), &count);
    if (words == nullptr) fail(ENOMEM);
    std::vector<std::string> arguments;
    for (int i = 0; i < count; ++i)
        arguments.push_back(to_utf8(words[i]));
    LocalFree(words);
    return arguments;
}

std::filesystem::path path_of(std::string_view text)
{
    return from_utf8(text);
}

std::string text_of(const std::filesystem::path& path)
{
    return to_utf8(path.native());
}

bool stderr_is_terminal()
{
    const HANDLE handle = GetStdHandle(STD_ERROR_HANDLE);
    DWORD mode = 0;
    return GetConsoleMode(handle, &mode) != 0 &&
           SetConsoleMode(handle, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

std::filesystem::path this_program()
{
    std::wstring name(MAX_PATH, L'\0');
    for (;;) {
        const DWORD size = GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size()));
        if (size < name.size()) {
            name.resize(size);
            return name;
        }
        name.resize(2 * name.size());
    }
}

std::string processor_name()
{
    wchar_t name[256] = L"";
    DWORD size = sizeof name;
    const LSTATUS status =
        RegGetValueW(HKEY_LOCAL_MACHINE, L"HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0",
                     L"ProcessorNameString", RRF_RT_REG_SZ, nullptr, name, &size);
    return status == ERROR_SUCCESS ? to_utf8(name) : "";
}

void set_default_variable(const char* name, const char* value)
{
    if (std::getenv(name) == nullptr) _putenv_s(name, value);
}

double processor_ms()
{
    FILETIME created, ended, kernel, user;
    if (GetProcessTimes(GetCurrentProcess(), &created, &ended, &kernel, &user) == 0) return 0;
    const auto ms = [](const FILETIME& time) { // in units of 100 nanoseconds
        return static_cast<double>(std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime) / 1e4;
    };
    return ms(kernel) + ms(user);
}

std::uint64_t preemptions()
{
    return 0;
}

std::uint64_t allocated_bytes()
{
    std::vector<HANDLE> heaps(GetProcessHeaps(0, nullptr));
    heaps.resize(
        std::min<std::size_t>(heaps.size(), GetProcessHeaps(static_cast<DWORD>(heaps.size()), heaps.data())));
    std::uint64_t bytes = 0;
    for (const HANDLE heap : heaps) {
        if (HeapLock(heap) == 0) continue;
        PROCESS_HEAP_ENTRY entry{};
        while (HeapWalk(heap, &entry) != 0)
            if ((entry.wFlags & PROCESS_HEAP_ENTRY_BUSY) != 0) bytes += entry.cbData;
        HeapUnlock(heap);
    }
    return bytes;
}

bool is_stream(const std::filesystem::path& path)
{
    const HANDLE file = CreateFileW(path.c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                    nullptr, OPEN_EXISTING, 0, nullptr);
    if (file == INVALID_HANDLE_VALUE) return false; // a directory is none that can be opened like this
    const DWORD type = GetFileType(file);
    CloseHandle(file);
    return type != FILE_TYPE_DISK;
}

int open_to_read(const std::filesystem::path& path)
{
    const int file = _wopen(path.c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT);
    if (file < 0) fail(errno);
    return file;
}

int open_to_write(const std::filesystem::path& path)
{
    const int file = _wopen(path.c_str(), _O_WRONLY | _O_BINARY | _O_NOINHERIT);
    if (file < 0) fail(errno);
    return file;
}

std::optional<std::uint64_t> size_of(int file)
{
    struct _stat64 status;
    if (_fstat64(file, &status) != 0 || (status.st_mode & _S_IFMT) != _S_IFREG) return std::nullopt;
    return static_cast<std::uint64_t>(status.st_size);
}

std::size_t read_some(int file, char* to, std::size_t most)
{
    const int got = _read(file, to, static_cast<unsigned>(std::min(most, std::size_t{1} << 24)));
    if (got < 0) fail(errno);
    return static_cast<std::size_t>(got);
}

void write_all(int file, std::string_view bytes)
{
    while (!bytes.empty()) {
        const int written =
            _write(file, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), largest_piece)));
        if (written < 0) fail(errno);
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

void close_file(int file)
{
    if (_close(file) != 0) fail(errno);
}

std::optional<Finished> run_program(const std::vector<std::string>& command, Errors errors,
                                    std::string_view input)
{
    std::wstring line;
    for (const std::string& word : command)
        append_quoted(line, from_utf8(word));
    SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
    Handle from, to;
    if (CreatePipe(&from.handle, &to.handle, &inherited, 0) == 0) fail(EMFILE);
    SetHandleInformation(from.handle, HANDLE_FLAG_INHERIT, 0);
    Handle read_by_it;
    if (!input.empty()) { // a file that is gone once nobody has it open
        const auto name = std::filesystem::temp_directory_path() / path_of("jostle-" + random_letters());
        read_by_it.handle =
            CreateFileW(name.c_str(), GENERIC_READ | GENERIC_WRITE | DELETE, 0, &inherited, CREATE_NEW,
                        FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, nullptr);
        if (read_by_it.handle == INVALID_HANDLE_VALUE) fail(EACCES);
        for (DWORD written = 0; !input.empty(); input.remove_prefix(written))
            if (WriteFile(read_by_it.handle, input.data(),
                          static_cast<DWORD>(std::min<std::size_t>(input.size(), 1 << 20)), &written,
                          nullptr) == 0)
                fail(ENOSPC);
        SetFilePointer(read_by_it.handle, 0, nullptr, FILE_BEGIN);
    }
    STARTUPINFOW streams{};
    streams.cb = sizeof streams;
    streams.dwFlags = STARTF_USESTDHANDLES;
    streams.hStdInput = read_by_it.handle != nullptr ? read_by_it.handle : GetStdHandle(STD_INPUT_HANDLE);
    streams.hStdOutput = to.handle;
    streams.hStdError = errors == Errors::taken ? to.handle : GetStdHandle(STD_ERROR_HANDLE);
    PROCESS_INFORMATION started{};
    if (CreateProcessW(nullptr, line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &streams,
                       &started) == 0)
        return std::nullopt;
    const Handle process{started.hProcess}, thread{started.hThread};
    CloseHandle(to.handle); // else this end would keep the pipe open
    to.handle = nullptr;
    Finished finished;
    std::array<char, 4096> piece;
    for (DWORD count = 0;
         ReadFile(from.handle, piece.data(), static_cast<DWORD>(piece.size()), &count, nullptr) != 0 &&
         count > 0;)
        finished.output.append(piece.data(), count);
    WaitForSingleObject(process.handle, INFINITE);
    DWORD status = 1;
    finished.well = GetExitCodeProcess(process.handle, &status) != 0 && status == 0;
    return finished;
}

} // namespace jostle_system
