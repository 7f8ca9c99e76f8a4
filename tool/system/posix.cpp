// SPDX-License-Identifier: MIT
#include "tool/system/system.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <system_error>

namespace jostle_system {

namespace {

[[noreturn]] void fail(int error)
{
    throw std::system_error(error, std::generic_category());
}

} // namespace

std::vector<std::string> start(int argc, char** argv)
{
    // A program that was started without stdin, stdout or stderr would get their numbers for the first files
    // that it opens, and then print into them. These take their place and can't be used: a read or write
    // fails.
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
            (void)open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY); // the lowest free number
    return {argv, argv + argc};
}

std::filesystem::path path_of(std::string_view text)
{
    return text;
}

std::string text_of(const std::filesystem::path& path)
{
    return path.native();
}

bool stderr_is_terminal()
{
    return isatty(STDERR_FILENO) != 0;
}

std::filesystem::path this_program()
{
    std::error_code unknown; // where there is no /proc
    return std::filesystem::read_symlink("/proc/self/exe", unknown);
}

std::string processor_name()
{
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name"))
            if (const std::size_t at = line.find(": "); at != std::string::npos) return line.substr(at + 2);
    utsname system{};
    return uname(&system) == 0 ? system.machine : "";
}

void set_default_variable(const char* name, const char* value)
{
    setenv(name, value, 0);
}

double processor_ms()
{
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) / 1e6;
}

std::uint64_t preemptions()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_nivcsw);
}

std::uint64_t allocated_bytes()
{
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

bool is_stream(const std::filesystem::path& path)
{
    std::error_code unknown; // then opening it will say
    const std::filesystem::file_status status = std::filesystem::status(path, unknown);
    return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
           !std::filesystem::is_directory(status);
}

int open_to_read(const std::filesystem::path& path)
{
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) fail(errno);
    return file;
}

int open_to_write(const std::filesystem::path& path)
{
    const int file = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) fail(errno);
    return file;
}

std::optional<std::uint64_t> size_of(int file)
{
    struct stat status;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
    return static_cast<std::uint64_t>(status.st_size);
}

std::size_t read_some(int file, char* to, std::size_t most)
{
    for (;;) {
        const ssize_t got = read(file, to, most);
        if (got >= 0) return static_cast<std::size_t>(got);
        if (errno != EINTR) fail(errno);
    }
}

void write_all(int file, std::string_view bytes)
{
    while (!bytes.empty()) {
        const ssize_t written = write(file, bytes.data(), bytes.size());
        if (written >= 0)
            bytes.remove_prefix(static_cast<std::size_t>(written));
        else if (errno != EINTR)
            fail(errno);
    }
}

void close_file(int file)
{
    if (close(file) != 0) fail(errno);
}

namespace {

/// A descriptor that is closed at the end, whatever happens before; negative for none.
class Descriptor
{
  public:
    explicit Descriptor(int number) noexcept : number_(number) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    [[nodiscard]] int get() const noexcept { return number_; }
    void close() noexcept
    {
        if (number_ >= 0) ::close(number_);
        number_ = -1;
    }

  private:
    int number_;
};

struct Pipe
{
    Descriptor from, to;
};
Pipe make_pipe()
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail(errno);
    return {Descriptor(ends[0]), Descriptor(ends[1])};
}

/// A file without a name, from which the text is read; it is gone once nobody has it open.
int file_with(std::string_view text)
{
    std::FILE* const file = std::tmpfile();
    if (file == nullptr) fail(errno);
    const bool written =
        std::fwrite(text.data(), 1, text.size(), file) == text.size() && std::fflush(file) == 0;
    const int number = written ? fcntl(fileno(file), F_DUPFD_CLOEXEC, 3) : -1;
    const int failure = errno;
    std::fclose(file);
    if (number < 0) fail(failure);
    lseek(number, 0, SEEK_SET);
    return number;
}

} // namespace

std::optional<Finished> run_program(const std::vector<std::string>& command, Errors errors,
                                    std::string_view input)
{
    std::vector<char*> words;
    for (const std::string& word : command)
        words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    Descriptor file(input.empty() ? -1 : file_with(input));
    Pipe output = make_pipe(), refusal = make_pipe();
    const pid_t here = getpid(), child = fork();
    int failure = child < 0 ? errno : 0;
    if (child == 0) {
        // It ends with this program, whatever ends that: mpiexec would go on, and its ranks.
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (getppid() != here) _exit(127); // which had ended before
        if (!input.empty()) dup2(file.get(), STDIN_FILENO);
        dup2(output.to.get(), STDOUT_FILENO);
        if (errors == Errors::taken) dup2(output.to.get(), STDERR_FILENO);
        execvp(words[0], words.data());
        const int why = errno;
        (void)!write(refusal.to.get(), &why, sizeof why);
        _exit(127);
    }
    output.to.close();
    refusal.to.close();
    file.close();
    // The program's start closes the other end without a word.
    for (ssize_t told = -1; failure == 0 && told < 0;) {
        told = read(refusal.from.get(), &failure, sizeof failure);
        if (told < 0 && errno != EINTR) break;
    }
    refusal.from.close();
    Finished finished;
    std::array<char, 4096> piece;
    while (failure == 0) {
        const ssize_t count = read(output.from.get(), piece.data(), piece.size());
        if (count == 0 || (count < 0 && errno != EINTR)) break;
        if (count > 0) finished.output.append(piece.data(), static_cast<std::size_t>(count));
    }
    output.from.close();
    int status = 0;
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (failure != 0) return std::nullopt;
    finished.well = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    return finished;
}

} // namespace jostle_system
