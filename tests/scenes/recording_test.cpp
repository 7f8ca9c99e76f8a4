// SPDX-License-Identifier: MIT
#include "tool/scenes/recording.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "jostle/recorder.hpp"
#include "tool/scenes/random.hpp"
#include "tool/scenes/scenes.hpp"

using namespace jostle;
using namespace jostle_scenes;
namespace fs = std::filesystem;

namespace {

/// A file name of this test alone, gone afterwards.
class TemporaryFile
{
  public:
    explicit TemporaryFile(const std::string& more = "")
        : path_(fs::temp_directory_path() /
                ("jostle-" + std::to_string(::getpid()) + "-" +
                 testing::UnitTest::GetInstance()->current_test_info()->name() + more + ".jrec"))
    {
    }
    ~TemporaryFile() { fs::remove(path_); }
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

std::string bytes_of(const fs::path& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
void write_bytes(const fs::path& path, const std::string& bytes)
{
    std::ofstream(path, std::ios::binary) << bytes;
}

template <int Dim, class T>
using Frames = std::vector<std::vector<Aabb<Dim, T>>>;

template <int Dim, class T>
void record(const fs::path& path, const Frames<Dim, T>& frames)
{
    RecordingWriter<Dim, T> writer(path, static_cast<std::uint32_t>(frames.at(0).size()), 60,
                                   "what it shows");
    for (const auto& frame : frames)
        writer.add_frame(frame);
    writer.finish();
}

template <int Dim, class T>
Frames<Dim, T> scene_frames(const char* name, std::size_t objects, int count)
{
    Frames<Dim, T> frames;
    Scene<Dim, T> scene(name, objects);
    for (int i = 0; i < count; ++i, scene.step())
        frames.emplace_back(scene.boxes().begin(), scene.boxes().end());
    return frames;
}

template <int Dim, class T>
void expect_same(const fs::path& path, const Frames<Dim, T>& frames)
{
    RecordingReader reader(path);
    EXPECT_EQ(reader.info().dim, Dim);
    EXPECT_EQ(reader.info().coordinate_bytes, static_cast<int>(sizeof(T)));
    EXPECT_EQ(reader.info().objects, frames.at(0).size());
    EXPECT_EQ(reader.info().frames, frames.size());
    EXPECT_EQ(reader.info().frames_per_second, 60);
    EXPECT_EQ(reader.info().description, "what it shows");
    std::vector<Aabb<Dim, T>> boxes;
    for (int pass = 0; pass < 2; ++pass, reader.rewind()) {
        for (const auto& frame : frames) {
            ASSERT_TRUE(reader.next(boxes));
            ASSERT_EQ(boxes.size(), frame.size());
            ASSERT_TRUE(boxes.empty() ||
                        std::memcmp(boxes.data(), frame.data(), frame.size() * sizeof(frame[0])) == 0);
        }
        EXPECT_FALSE(reader.next(boxes));
        EXPECT_TRUE(boxes.empty());
    }
}

/// What reading the whole file complains of; "" if it doesn't.
std::string complaint(const fs::path& path)
{
    try {
        RecordingReader reader(path);
        std::vector<Aabb3f> boxes;
        while (reader.next(boxes)) {
        }
        return "";
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

// --- What jostle::Recorder writes ---

/// Frames of different numbers of boxes, with every kind of number.
template <int Dim, class T>
Frames<Dim, T> odd_frames()
{
    Random random(7);
    Frames<Dim, T> frames;
    for (const std::size_t size : {3u, 0u, 5u, 1u}) {
        auto& boxes = frames.emplace_back(size);
        for (Aabb<Dim, T>& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = static_cast<T>(random.uniform(-1e6, 1e6));
                box.hi[d] = static_cast<T>(random.uniform(-1e6, 1e6));
            }
        if (!boxes.empty()) {
            boxes[0].lo[0] = std::numeric_limits<T>::quiet_NaN();
            boxes[0].hi[0] = std::numeric_limits<T>::infinity();
            boxes[0].lo[1] = -std::numeric_limits<T>::denorm_min();
            boxes[0].hi[1] = -T(0);
        }
    }
    return frames;
}

template <int Dim, class T>
void expect_frames(RecordingReader& reader, const Frames<Dim, T>& frames)
{
    std::vector<Aabb<Dim, T>> boxes;
    for (const auto& expected : frames) {
        ASSERT_TRUE(reader.next(boxes));
        ASSERT_EQ(boxes.size(), expected.size());
        if (!expected.empty()) {
            EXPECT_EQ(std::memcmp(boxes.data(), expected.data(), expected.size() * sizeof(expected[0])), 0);
        }
    }
    EXPECT_FALSE(reader.next(boxes));
}

template <int Dim, class T>
void expect_recorded_exactly(const fs::path& path)
{
    const auto frames = odd_frames<Dim, T>();
    jostle::Recorder<Dim, T> recorder(path.string(), 30, "odd numbers");
    for (const auto& boxes : frames)
        recorder.frame(boxes);
    EXPECT_EQ(recorder.frames(), frames.size());
    recorder.close();
    recorder.close(); // once is enough, twice does no harm

    RecordingReader reader(path);
    EXPECT_EQ(reader.info().dim, Dim);
    EXPECT_EQ(reader.info().coordinate_bytes, static_cast<int>(sizeof(T)));
    EXPECT_EQ(reader.info().objects, 5u);
    EXPECT_EQ(reader.info().frames, frames.size());
    EXPECT_EQ(reader.info().frames_per_second, 30);
    EXPECT_EQ(reader.info().description, "odd numbers");
    expect_frames(reader, frames);
    reader.rewind();
    expect_frames(reader, frames);
}

TEST(Recorder, IsReadBackToTheLastBit)
{
    const TemporaryFile file;
    expect_recorded_exactly<2, float>(file.path());
    expect_recorded_exactly<3, float>(file.path());
    expect_recorded_exactly<2, double>(file.path());
    expect_recorded_exactly<3, double>(file.path());
}

TEST(Recorder, ReadsBoxesWhereTheyLie)
{
    struct Enemy
    {
        int id;
        float min[3], max[3];
    };
    const std::vector<Enemy> enemies = {{1, {0, 1, 2}, {3, 4, 5}}, {2, {6, 7, 8}, {9, 10, 11}}};
    const TemporaryFile file;
    {
        jostle::Recorder<3, float> recorder(file.path().string());
        recorder.frame(BoxView<3, float>::strided(enemies[0].min, enemies[0].max, 2, sizeof(Enemy)));
    } // closed by the destructor
    RecordingReader reader(file.path());
    expect_frames<3, float>(reader, {{{{0, 1, 2}, {3, 4, 5}}, {{6, 7, 8}, {9, 10, 11}}}});
}

// A program that crashed: what it wrote is there, up to the last whole frame.
TEST(Recorder, FramesOfOneThatWasNotClosedAreRead)
{
    const TemporaryFile file, copy("copy");
    const auto frames = odd_frames<3, float>();
    {
        jostle::Recorder<3, float> recorder(file.path().string());
        for (const auto& boxes : frames)
            recorder.frame(boxes);
        recorder.close();
    }
    std::string bytes = bytes_of(file.path());
    bytes.replace(24, 8, std::string(8, '\xff')); // the number of frames, as before close()
    std::uint64_t sum = 0xcbf29ce484222325u;
    for (std::size_t i = 0; i < 40; ++i)
        sum = jostle::detail::add_to_sum(sum, static_cast<unsigned char>(bytes[i]));
    for (std::size_t i = 0; i < 8; ++i)
        bytes[40 + i] = static_cast<char>(static_cast<unsigned char>(sum >> (8 * i)));

    const std::size_t last_frame = 4 + 24 + 8;
    for (std::size_t missing = 0; missing <= last_frame; ++missing) {
        write_bytes(copy.path(), bytes.substr(0, bytes.size() - missing));
        RecordingReader reader(copy.path());
        const std::size_t whole = missing == 0 ? frames.size() : frames.size() - 1;
        EXPECT_EQ(reader.info().frames, whole) << missing;
        expect_frames<3, float>(reader,
                                {frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(whole)});
    }
}

TEST(Recorder, WhatAProgramWroteThatWasKilledIsThere)
{
    const TemporaryFile file;
    const auto frames = odd_frames<3, float>();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        jostle::Recorder<3, float> recorder(file.path().string(), 30, "killed");
        bool good = true;
        for (const auto& boxes : frames) // a few hundred bytes: less than any buffer
            good = recorder.frame(boxes) && good;
        if (good) std::raise(SIGKILL);
        _exit(1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    RecordingReader reader(file.path());
    EXPECT_EQ(reader.info().description, "killed");
    EXPECT_EQ(reader.info().objects, 5u);
    ASSERT_EQ(reader.info().frames, frames.size());
    expect_frames<3, float>(reader, frames);
}

TEST(Recorder, MovesWithWhatItHasWritten)
{
    const TemporaryFile file, expected("expected");
    const auto frames = odd_frames<3, float>();
    jostle::Recorder<3, float> whole(expected.path().string(), 30, "moved");
    jostle::Recorder<3, float> begun(file.path().string(), 30, "moved");
    for (const auto& boxes : frames)
        EXPECT_TRUE(whole.frame(boxes));
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_TRUE(begun.frame(frames[i]));
    jostle::Recorder<3, float> moved(std::move(begun));
    EXPECT_EQ(moved.frames(), 3u);
    EXPECT_TRUE(moved.frame(frames[3])); // which isn't the greatest
    EXPECT_TRUE(moved.close());
    EXPECT_TRUE(whole.close());
    EXPECT_EQ(bytes_of(file.path()), bytes_of(expected.path()));
    jostle::Recorder<3, float> broken("/no/such/folder/a.jrec");
    const jostle::Recorder<3, float> still(std::move(broken));
    EXPECT_NE(still.problem().find("No such file"), std::string::npos);
}

TEST(Recorder, ADescriptionHasNoMoreThanItsMost)
{
    const TemporaryFile file;
    for (const std::size_t size : {65'536u, 65'537u}) {
        jostle::Recorder<2, double> recorder(file.path().string(), 0, std::string(size, 'x'));
        EXPECT_EQ(recorder.frame(std::vector<jostle::Aabb2d>(1)), size == 65'536);
        EXPECT_EQ(recorder.close(), size == 65'536);
        if (size == 65'536) {
            EXPECT_EQ(RecordingReader(file.path()).info().description, std::string(size, 'x'));
        }
    }
}

TEST(Recorder, AlteredOrTruncatedFilesAreRefused)
{
    const TemporaryFile file, copy("copy");
    {
        jostle::Recorder<2, float> recorder(file.path().string(), 1, "d");
        for (const auto& boxes : odd_frames<2, float>())
            recorder.frame(boxes);
    }
    const std::string bytes = bytes_of(file.path());
    const auto read_all = [&] {
        RecordingReader reader(copy.path());
        std::vector<Aabb2f> boxes;
        while (reader.next(boxes)) {
        }
    };
    write_bytes(copy.path(), bytes);
    EXPECT_NO_THROW(read_all());
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        std::string altered = bytes;
        altered[i] = static_cast<char>(altered[i] ^ 0x10);
        write_bytes(copy.path(), altered);
        EXPECT_ANY_THROW(read_all()) << "byte " << i;
        write_bytes(copy.path(), bytes.substr(0, i));
        EXPECT_ANY_THROW(read_all()) << "cut to " << i;
    }
    write_bytes(copy.path(), bytes + "x");
    EXPECT_ANY_THROW(read_all());
}

TEST(Recorder, SaysWhatCantBeWritten)
{
    jostle::Recorder<3, float> nowhere("/no/such/folder/a.jrec");
    EXPECT_EQ(nowhere.problem(), "/no/such/folder/a.jrec: can't be written: No such file or directory");
    EXPECT_FALSE(nowhere.frame(std::vector<Aabb3f>(1)));
    EXPECT_FALSE(nowhere.close());
    EXPECT_EQ(nowhere.frames(), 0u);

    jostle::Recorder<3, float> full("/dev/full");
    EXPECT_FALSE(full.frame(std::vector<Aabb3f>(100'000)));
    EXPECT_EQ(full.problem(), "/dev/full: can't be written: No space left on device");
    EXPECT_FALSE(full.frame(std::vector<Aabb3f>(1)));
    EXPECT_FALSE(full.close());

    jostle::Recorder<3, float> full_at_once("/dev/full"); // not even the header
    EXPECT_NE(full_at_once.problem().find("No space left"), std::string::npos);
    EXPECT_FALSE(full_at_once.frame(std::vector<Aabb3f>(1)));
    EXPECT_FALSE(full_at_once.close());
    EXPECT_EQ(full_at_once.frames(), 0u);

    // A disk that fills up and has room again: what couldn't be written is missing, and nothing comes after
    // it.
    const TemporaryFile short_file("-short");
    {
        jostle::Recorder<3, float> stopped(short_file.path().string());
        EXPECT_TRUE(stopped.frame(std::vector<Aabb3f>(10)));
        rlimit before{};
        ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
        const auto handler = std::signal(SIGXFSZ, SIG_IGN);
        rlimit small = before;
        small.rlim_cur = 2000;
        ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
        const bool written = stopped.frame(std::vector<Aabb3f>(1000));
        ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
        std::signal(SIGXFSZ, handler);
        EXPECT_FALSE(written);
        EXPECT_EQ(stopped.frames(), 1u);
        EXPECT_NE(stopped.problem().find("can't be written"), std::string::npos);
        EXPECT_FALSE(stopped.frame(std::vector<Aabb3f>(1)));
        EXPECT_EQ(stopped.frames(), 1u);
        EXPECT_FALSE(stopped.close());
    }

    const TemporaryFile file;
    jostle::Recorder<3, float> closed(file.path().string());
    EXPECT_TRUE(closed.close());
    EXPECT_FALSE(closed.frame(std::vector<Aabb3f>(1)));
    EXPECT_NE(closed.problem().find("is closed"), std::string::npos);
    const jostle::Recorder<3, float> talkative(file.path().string(), 0, std::string(70'000, 'x'));
    EXPECT_NE(talkative.problem().find("65536"), std::string::npos);
    for (const double odd : {-1.0, std::nan(""), HUGE_VAL}) {
        const jostle::Recorder<3, float> timeless(file.path().string(), odd);
        EXPECT_NE(timeless.problem().find("frames_per_second must be"), std::string::npos) << odd;
    }
}

} // namespace

TEST(Recording, GivesBackEveryBitOfEveryType)
{
    const TemporaryFile file;
    for (const char* name : {"uniform", "resting", "far", "lattice"}) {
        SCOPED_TRACE(name);
        const auto check = [&](const auto& frames) {
            record(file.path(), frames);
            expect_same(file.path(), frames);
        };
        check(scene_frames<2, float>(name, 300, 6));
        check(scene_frames<2, double>(name, 300, 6));
        check(scene_frames<3, float>(name, 300, 6));
        check(scene_frames<3, double>(name, 300, 6));
        check(scene_frames<3, float>(name, 0, 3));
        check(scene_frames<3, float>(name, 1, 1));
    }
}

TEST(Recording, GivesBackAnyBitsWhatever)
{
    // Infinities, NaNs of every payload, denormals, both zeros: whatever a physics engine may produce.
    const TemporaryFile file;
    Random random(5);
    Frames<3, double> frames(5, std::vector<Aabb3d>(200));
    for (auto& frame : frames)
        for (Aabb3d& box : frame)
            for (double* bound : {box.lo.data(), box.hi.data()})
                for (int d = 0; d < 3; ++d) {
                    constexpr double special[] = {0.0,
                                                  -0.0,
                                                  std::numeric_limits<double>::infinity(),
                                                  -std::numeric_limits<double>::infinity(),
                                                  std::numeric_limits<double>::max(),
                                                  std::numeric_limits<double>::denorm_min()};
                    const std::uint64_t bits = random.next();
                    std::memcpy(&bound[d], &bits, 8);
                    if (random.below(2) == 0) bound[d] = special[random.below(6)];
                }
    record(file.path(), frames);
    expect_same(file.path(), frames);
}

TEST(Recording, IsCompactWhereLittleHappens)
{
    const TemporaryFile file;
    const auto size_of = [&](const char* name) {
        record(file.path(), scene_frames<3, float>(name, 2000, 20));
        return fs::file_size(file.path());
    };
    const std::uintmax_t raw = 2000 * 20 * sizeof(Aabb3f);
    EXPECT_LT(size_of("resting"), raw / 8);
    EXPECT_LT(size_of("uniform"), raw / 3); // straight flight, but for rounding
}

TEST(Recording, NamesTheFileAndThePlaceWhereverItIsCutOff)
{
    const TemporaryFile file;
    record(file.path(), scene_frames<3, float>("uniform", 5, 3));
    const std::string whole = bytes_of(file.path());
    ASSERT_EQ(complaint(file.path()), "");
    bool header_seen = false, frame_seen = false;
    for (std::size_t size = 0; size < whole.size(); ++size) {
        write_bytes(file.path(), whole.substr(0, size));
        const std::string said = complaint(file.path());
        ASSERT_TRUE(contains(said, file.path().string() + ": is ")) << size << ": " << said;
        header_seen |= contains(said, "is truncated: it ends inside the header; copy or record it again");
        frame_seen |= contains(said, "is truncated: it ends inside frame 2 of 3; copy or record it again");
    }
    EXPECT_TRUE(header_seen);
    EXPECT_TRUE(frame_seen);
}

TEST(Recording, NeverHandsOutAnAlteredFrame)
{
    const TemporaryFile file;
    const auto frames = scene_frames<3, float>("uniform", 5, 3);
    record(file.path(), frames);
    const std::string whole = bytes_of(file.path());
    int noticed = 0, unnoticed = 0;
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string altered = whole;
        altered[at] = static_cast<char>(altered[at] ^ (1 << at % 8));
        write_bytes(file.path(), altered);
        const std::string said = complaint(file.path());
        if (said.empty())
            expect_same(file.path(), frames); // some bits of a zstd block mean nothing
        else
            ASSERT_TRUE(contains(said, file.path().string())) << at << ": " << said;
        ++(said.empty() ? unnoticed : noticed);
    }
    EXPECT_GT(noticed, 30 * unnoticed);
    write_bytes(file.path(), whole + "x");
    EXPECT_TRUE(contains(complaint(file.path()), "follows its last frame"));
    write_bytes(file.path(), "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n" + std::string(100, ' '));
    EXPECT_TRUE(contains(complaint(file.path()), "is no recording of moving boxes"));
    write_bytes(file.path(), whole.substr(0, 7) + '\3' + whole.substr(8));
    EXPECT_TRUE(contains(complaint(file.path()), "version 3"));
    write_bytes(file.path(),
                whole.substr(0, 7) + '\2' + whole.substr(8)); // a Recorder's, but for the checksum
    EXPECT_TRUE(contains(complaint(file.path()), "was altered in its header"));
    EXPECT_TRUE(contains(complaint("/nowhere/x.jrec"), "/nowhere/x.jrec: can't be read: No such file"));
    EXPECT_TRUE(contains(complaint("/tmp"), "/tmp: can't be read"));
}

TEST(Recording, KeepsItsFormat)
{
    // Fingerprints of frames of the recording in the repository. A change here means that recordings made
    // before can't be read any more, or are read as something else.
    RecordingReader reader(JOSTLE_DATA_DIR "/tumble.jrec");
    std::vector<Aabb3f> boxes;
    std::vector<std::uint64_t> fingerprints;
    for (int frame = 0; reader.next(boxes); ++frame) {
        if (frame != 0 && frame != 1 && frame != 2 && frame != 219) continue;
        std::uint64_t hash = 0xcbf29ce484222325u;
        for (const Aabb3f& box : boxes)
            for (const float* bound : {box.lo.data(), box.hi.data()})
                for (int d = 0; d < 3; ++d) {
                    std::uint32_t bits;
                    std::memcpy(&bits, &bound[d], sizeof bits);
                    hash = (hash ^ bits) * 0x100000001b3u;
                }
        fingerprints.push_back(hash);
    }
    EXPECT_EQ(fingerprints, (std::vector<std::uint64_t>{0x7c1231ba21396447, 0xe8014ecff746bbcc,
                                                        0x25a3e312c560a7ed, 0x3838717e603a88d8}));
}

/// Where the frames of a recording of `record`'s begin, and where it ends.
std::vector<std::size_t> frame_places(const std::string& bytes)
{
    std::vector<std::size_t> places;
    for (std::size_t at = 40 + std::string("what it shows").size() + 8; at < bytes.size();) {
        places.push_back(at);
        std::uint32_t size;
        std::memcpy(&size, bytes.data() + at, 4); // the tests run on little-endian machines
        at += 4 + size;
    }
    places.push_back(bytes.size());
    return places;
}

TEST(Recording, NoticesFramesOutOfPlaceAndBytesTooMany)
{
    const TemporaryFile file;
    record(file.path(), scene_frames<3, float>("uniform", 5, 3));
    const std::string whole = bytes_of(file.path());
    const std::vector<std::size_t> at = frame_places(whole);
    ASSERT_EQ(at.size(), 4u);
    const auto part = [&](std::size_t k) { return whole.substr(at[k], at[k + 1] - at[k]); };
    const std::string header = whole.substr(0, at[0]);
    write_bytes(file.path(), header + part(1) + part(0) + part(2));
    EXPECT_TRUE(contains(complaint(file.path()), "was altered in frame 1 of 3")) << complaint(file.path());
    write_bytes(file.path(), header + part(0) + part(2) + part(2));
    EXPECT_TRUE(contains(complaint(file.path()), "was altered in frame 2 of 3"));
    std::string longer = part(0) + "x";
    ++longer[0]; // the size of the block: below 255
    write_bytes(file.path(), header + longer + part(1) + part(2));
    EXPECT_TRUE(contains(complaint(file.path()), "was altered in frame 1 of 3"));
    std::string shorter = part(0).substr(0, part(0).size() - 1);
    --shorter[0];
    write_bytes(file.path(), header + shorter + part(1) + part(2));
    EXPECT_TRUE(contains(complaint(file.path()), "was altered in frame 1 of 3"));
    write_bytes(file.path(), whole);
    EXPECT_EQ(complaint(file.path()), "");
}

TEST(Recording, ReadsFromAPipeOnce)
{
    const TemporaryFile file, pipe_name("pipe");
    const auto frames = scene_frames<3, float>("uniform", 5000, 3); // more bytes than a pipe holds
    record(file.path(), frames);
    const std::string bytes = bytes_of(file.path());
    ASSERT_EQ(::mkfifo(pipe_name.path().c_str(), 0600), 0);
    std::thread writer([&] { write_bytes(pipe_name.path(), bytes); });
    {
        RecordingReader reader(pipe_name.path());
        std::vector<Aabb3f> boxes;
        for (const auto& frame : frames) {
            ASSERT_TRUE(reader.next(boxes));
            ASSERT_EQ(std::memcmp(boxes.data(), frame.data(), frame.size() * sizeof(frame[0])), 0);
        }
        EXPECT_FALSE(reader.next(boxes));
        try {
            reader.rewind();
            ADD_FAILURE() << "a pipe was read again";
        } catch (const std::runtime_error& error) {
            EXPECT_TRUE(contains(error.what(), "is a pipe, which can't be read again"));
        }
    }
    writer.join();
}

TEST(Recording, AppearsWholeOrNotAtAll)
{
    const TemporaryFile file;
    const auto frames = scene_frames<2, double>("uniform", 5, 2);
    {
        RecordingWriter<2, double> writer(file.path(), 5, 0, "");
        writer.add_frame(frames[0]);
        EXPECT_FALSE(fs::exists(file.path()));
        EXPECT_THROW(writer.add_frame(std::span(frames[0]).first(4)), std::invalid_argument);
        auto one_more = frames[0];
        one_more.push_back(one_more.back());
        EXPECT_THROW(writer.add_frame(one_more), std::invalid_argument);
    }
    const auto left = [&] {
        std::size_t files = 0;
        for (const auto& entry : fs::directory_iterator(file.path().parent_path()))
            files += entry.path().string().starts_with(file.path().string());
        return files;
    };
    EXPECT_EQ(left(), 0u);
    record(file.path(), frames);
    EXPECT_EQ(left(), 1u);
    EXPECT_THROW((RecordingWriter<2, double>("/nowhere/x.jrec", 5, 0, "")), std::runtime_error);
    std::vector<Aabb3f> wrong;
    EXPECT_THROW(RecordingReader(file.path()).next(wrong), std::logic_error);
}
