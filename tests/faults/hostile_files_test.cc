#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/photograph.h"
#include "tests/faults/image_variants.h"
#include "tests/support/error_matchers.h"
#include "tests/support/run_hexcal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/camera_export.h"
#include "tools/io/csv_table.h"
#include "tools/io/observations_file.h"
#include "tools/io/sheet_file.h"
#include "tools/io/yaml_map.h"

// Files that want to be large, deep or endless: an error or a status with words, in bounded time and memory.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kPatienceS = 5;  // also under sanitizers
constexpr long kPatienceKb = 800 * 1024;

// Of the processor, so that a busy machine does not matter.
double processor_seconds(int whose = RUSAGE_SELF) {
  rusage usage{};
  ::getrusage(whose, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// `size` bytes of a number, most significant first.
std::string big_endian(std::uint32_t value, int size) {
  std::string text;
  for (int i = size - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xFFU);
  return text;
}

// A chunk whose checksum is wrong; sizes are believed, or not, before it is looked at.
std::string png_chunk(const std::string& type, const std::string& data) {
  return big_endian(static_cast<std::uint32_t>(data.size()), 4) + type + data + big_endian(0, 4);
}

std::string png_of(std::uint32_t width, std::uint32_t height) {
  return "\x89PNG\r\n\x1A\n" +
         png_chunk("IHDR", big_endian(width, 4) + big_endian(height, 4) + std::string("\x08\0\0\0\0", 5)) +
         png_chunk("IDAT", std::string(3000, '\0')) + png_chunk("IEND", "");
}

// Deflated, all in one strip; or in tiles.
std::string tiff_of(std::uint32_t width, std::uint32_t height, std::uint32_t bits = 8,
                    std::uint32_t tile = 0) {
  const auto entry = [](std::uint32_t tag, std::uint32_t value) {
    return big_endian(tag, 2) + big_endian(4, 2) + big_endian(1, 4) + big_endian(value, 4);
  };
  std::string entries =
      entry(256, width) + entry(257, height) + entry(258, bits) + entry(259, 8) + entry(262, 1);
  entries += tile == 0
                 ? entry(273, 200) + entry(277, 1) + entry(278, height) + entry(279, 3000)
                 : entry(277, 1) + entry(322, tile) + entry(323, tile) + entry(324, 200) + entry(325, 3000);
  const auto count = static_cast<std::uint32_t>(entries.size() / 12);
  const std::string head = std::string("MM\0*", 4) + big_endian(8, 4) + big_endian(count, 2) + entries;
  return head + std::string(200 - head.size(), '\0') + std::string(3000, '\0');
}

// A small picture whose frame header claims another size.
std::string jpeg_of(std::uint32_t width, std::uint32_t height) {
  std::string jpeg = encoded(cv::Mat(32, 32, CV_8UC1, cv::Scalar(128)), ".jpg");
  const std::size_t frame = jpeg.find("\xFF\xC0");
  jpeg.replace(frame + 5, 4, big_endian(height, 2) + big_endian(width, 2));
  return jpeg;
}

// A progressive picture of a million pixels with its last scan a thousand times.
std::string jpeg_of_many_scans() {
  const cv::Mat grey(1000, 1000, CV_8UC1, cv::Scalar(128));
  const std::string jpeg = encoded(grey, ".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  const std::size_t end = jpeg.rfind("\xFF\xD9");
  const std::size_t scan = jpeg.rfind("\xFF\xDA");
  const std::string last = jpeg.substr(scan, end - scan);
  std::string out = jpeg.substr(0, end);
  for (int i = 0; i < 1000; ++i) out += last;
  return out + jpeg.substr(end);
}

TEST(HostileFiles, PhotographsThatClaimToBeHugeAreRefusedWithWords) {
  const TemporaryFolder folder;
  const auto put = [&folder](const std::string& name, const std::string& bytes) {
    std::ofstream(folder.path() / name, std::ios::binary) << bytes;
  };
  for (const auto& [name, width, height] :
       {std::tuple("none", 0U, 0U), std::tuple("flat", 4000U, 0U), std::tuple("thin", 4000000000U, 1U),
        std::tuple("wide", 65500U, 65500U), std::tuple("large", 30000U, 30000U),
        std::tuple("dense", 12000U, 12000U)}) {
    // Of several formats of one name, one would be taken.
    put(std::string(name) + "_png.png", png_of(width, height));
    put(std::string(name) + "_8.tif", tiff_of(width, height));
    put(std::string(name) + "_16.tif", tiff_of(width, height, 16));
    put(std::string(name) + "_raw.dng", tiff_of(width, height, 16));
    put(std::string(name) + "_jpg.jpg", jpeg_of(width, height));
  }
  put("tile.tif", tiff_of(100, 100, 8, 1 << 20));
  put("bits.tif", tiff_of(100, 100, 4096));
  put("scans.jpg", jpeg_of_many_scans());
  put("one.png", "\x89");
  put("two.jpg", "\xFF\xD8");
  put("bmp.png", "BM" + std::string(100, '\xFF'));
  put("exr.tif", "\x76\x2F\x31\x01\x02" + std::string(100, '\0'));
  put("pgm.png", "P5 30000 30000 255\n" + std::string(100, '\0'));
  const double start = processor_seconds(RUSAGE_CHILDREN);
  const CommandResult result =
      run_hexcal({"detect", folder.path().string(), "-o", (folder.path() / "o.txt").string()});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_LT(processor_seconds(RUSAGE_CHILDREN) - start, kPatienceS);
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  EXPECT_LT(usage.ru_maxrss, kPatienceKb);
  const DetectionSet set = read_observations(folder.path() / "o.txt");
  EXPECT_EQ(set.photographs.size(), 6U * 5 + 8);
  for (const PhotographObservations& photograph : set.photographs) {
    EXPECT_NE(photograph.status, PhotographStatus::ok) << photograph.name;
    EXPECT_THAT(photograph.reason, Not(IsEmpty())) << photograph.name;
  }
}

TEST(HostileFiles, AFileThatIsLargerThanAPhotographIsNotRead) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.jpg";
  std::ofstream(path) << "\xFF\xD8\xFF";
  fs::resize_file(path, std::uintmax_t{5} << 30);
  const double start = processor_seconds();
  EXPECT_EQ(read_photograph(path).status, PhotographStatus::too_large);
  EXPECT_LT(processor_seconds() - start, 1);
}

std::string nested(int depth) { return "a: " + std::string(depth, '[') + std::string(depth, ']') + "\n"; }

// Nine levels of nine aliases each, a billion entries when written out.
std::string laughs() {
  std::string text = "a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n";
  for (int i = 1; i < 10; ++i) {
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 9; ++k) text += (k > 0 ? ", *a" : "*a") + std::to_string(i - 1);
    text += "]\n";
  }
  return text;
}

TEST(HostileFiles, DeepOrMultipliedYamlIsRefusedInBoundedTime) {
  for (const std::string& text :
       {nested(40), nested(100000), std::string("&a [*a]"), std::string("a: &a {b: *a}"), laughs(),
        std::string(20 << 20, 'a'), std::string(100000, '{'), std::string(100000, '-'),
        std::string("a: \"") + std::string(1 << 20, '\\')}) {
    const double start = processor_seconds();
    EXPECT_THROW(YamlMap::parse(text, "hostile.yaml").finish(), InputError) << text.substr(0, 20);
    EXPECT_LT(processor_seconds() - start, kPatienceS) << text.substr(0, 20);
  }
}

TEST(HostileFiles, AMessageShowsTheBeginningOfALongValue) {
  const YamlMap map = YamlMap::parse("a: " + std::string(100000, 'x') + "\n", "hostile.yaml");
  EXPECT_THAT([&map] { (void)map.number("a"); }, ThrowsInputError("hostile.yaml:1: a: found 'xxx"));
  EXPECT_THAT([&map] { (void)map.number("a"); }, ThrowsInputError("xxx' ..., wanted a number"));
}

TEST(HostileFiles, AHundredThousandKeysAreReadInBoundedTime) {
  std::string text;
  for (int i = 0; i < 100000; ++i) text += std::to_string(i) + ": 1\n";
  const double start = processor_seconds();
  const YamlMap map = YamlMap::parse(text, "keys.yaml");
  double sum = 0;
  for (const std::string& key : map.keys()) sum += map.number(key);
  EXPECT_EQ(sum, 100000);
  EXPECT_LT(processor_seconds() - start, kPatienceS);
}

TEST(HostileFiles, ASheetOfABillionRowsIsRefused) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "sheet.yaml")
      << "kind: chessboard\ncolumns: 1000000000\nrows: 1000000000\nsquare_mm: 1\n";
  EXPECT_THROW((void)read_sheet_file(folder.path() / "sheet.yaml"), InputError);
}

TEST(HostileFiles, ValuesThatNoCameraHasAreNoCamera) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "camera.yaml")
      << "photomodeler: {focal_mm: 35, principal_point_mm: [11.6, 7.7], format_mm: [1.2, 15.4],\n"
         "               k: [1.0e-4, 1.0e-7, 0], p: [1.0e-6, 0]}\n"
         "image_size_px: [6016, 4000]\n";
  EXPECT_THAT([&folder] { (void)read_foreign_camera(folder.path() / "camera.yaml"); },
              ThrowsInputError("no Brown camera has these values"));
}

TEST(HostileFiles, ATableWithoutLinesOrOfManyColumnsIsRefusedAtOnce) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a.csv";
  std::ofstream(path) << "pose,x_mm\n\"p";
  fs::resize_file(path, std::uintmax_t{200} << 20);
  const double start = processor_seconds();
  EXPECT_THAT([&path] { (void)CsvTable::read(path); }, ThrowsInputError("a.csv:2: no CSV table"));
  EXPECT_THROW((void)CsvTable::parse(std::string(10 << 20, ','), "a.csv"), InputError);
  EXPECT_THROW((void)CsvTable::parse(std::string(10 << 20, '"'), "a.csv"), InputError);
  EXPECT_LT(processor_seconds() - start, kPatienceS);
}

TEST(HostileFiles, WhatIsNoFileIsNotOpened) {
  const TemporaryFolder folder;
  const auto refuses = [](const fs::path& path, const std::string& words) {
    EXPECT_THAT([&path] { (void)read_file(path); }, ThrowsInputError(words)) << path;
    EXPECT_NE(read_photograph(path).status, PhotographStatus::ok) << path;
  };
  refuses("/dev/zero", "is a device, wanted a file");
  refuses("/dev/null", "is a device, wanted a file");
  refuses("/proc/version", "belongs to the kernel, wanted a file");
  fs::create_symlink("/proc/kmsg", folder.path() / "log.csv");  // a regular file, it says, and waits for news
  refuses(folder.path() / "log.csv", "belongs to the kernel, wanted a file");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.csv").c_str(), 0600), 0);
  refuses(folder.path() / "pipe.csv", "is a named pipe, wanted a file");
}

}  // namespace
}  // namespace hexcal
