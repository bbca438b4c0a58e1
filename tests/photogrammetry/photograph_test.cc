#include <gmock/gmock.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "photogrammetry/markers/detect.h"
#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/raster_header.h"
#include "tests/support/error_matchers.h"
#include "tests/support/temporary_folder.h"

// What the decoders say of each fault that a file's head can have, before a library's decoder believes it.

namespace hexcal {
namespace {

using ::testing::HasSubstr;

std::string big_endian(std::uint32_t value) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xFF);
  return out;
}

std::string png(std::uint32_t width, std::uint32_t height) {
  return std::string("\x89PNG\r\n\x1A\n", 8) + big_endian(13) + "IHDR" + big_endian(width) +
         big_endian(height) + std::string("\x08\0\0\0\0\0\0\0\0", 9) + big_endian(0) + "IEND" +
         "\xAE\x42\x60\x82";
}

enum TiffTag : std::uint16_t {
  kTiffWidth = 256,
  kTiffHeight = 257,
  kTiffBits = 258,
  kTiffSamples = 277,
  kTiffRows = 278,
  kTiffTileWidth = 322,
  kTiffTileHeight = 323,
};

// Big-endian, every value a 32-bit number.
std::string tiff(const std::vector<std::pair<TiffTag, std::uint32_t>>& entries) {
  const auto short_number = [](std::size_t value) {
    return big_endian(static_cast<std::uint32_t>(value)).substr(2);
  };
  std::string out = std::string("MM\0*", 4) + big_endian(8) + short_number(entries.size());
  for (const auto& [tag, value] : entries)
    out += short_number(tag) + short_number(4) + big_endian(1) + big_endian(value);
  return out + big_endian(0);
}

TEST(RasterHeader, OfAPngIsJudgedBeforeItIsDecoded) {
  EXPECT_EQ(read_png_header(png(640, 480)).status, PhotographStatus::ok);
  const std::string whole = png(640, 480);
  for (const std::string& cut : {whole.substr(0, whole.size() - 1), whole.substr(0, 40)}) {
    const RasterHeader header = read_png_header(cut);
    EXPECT_EQ(header.status, PhotographStatus::truncated);
    EXPECT_EQ(header.reason, "the PNG ends too early");
  }
  EXPECT_EQ(read_png_header(png(0, 480)).status, PhotographStatus::unreadable);
  EXPECT_EQ(read_png_header(png(0, 480)).reason, "a picture of 0 x 480 pixels");
  EXPECT_EQ(read_png_header(png(20000, 20000)).status, PhotographStatus::too_large);
  EXPECT_THAT(read_png_header(png(10000, 10000)).reason, HasSubstr("10000 x 10000 pixels in "));
}

TEST(RasterHeader, OfATiffIsJudgedBeforeItIsDecoded) {
  using Entries = std::vector<std::pair<TiffTag, std::uint32_t>>;
  const Entries good{{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 8}, {kTiffRows, 16}};
  ASSERT_EQ(read_tiff_header(tiff(good)).status, PhotographStatus::ok) << read_tiff_header(tiff(good)).reason;
  const auto expect = [](const std::string& bytes, const std::string& words) {
    const RasterHeader header = read_tiff_header(bytes);
    EXPECT_EQ(header.status, PhotographStatus::unreadable) << words;
    EXPECT_EQ(header.reason, words);
  };
  const std::string not_whole = "a TIFF without a whole directory that states width and height once";
  expect(tiff(good).substr(0, 30), not_whole);
  expect(std::string("II*\0", 4), not_whole);
  expect(tiff({{kTiffWidth, 640}, {kTiffBits, 8}}), not_whole);
  expect(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffWidth, 6400}, {kTiffBits, 8}}), not_whole);
  expect(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}}),
         "a TIFF of 1 bit and 1 samples a pixel, wanted 8 or 16 bit and 1 to 4 samples");
  expect(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 16}, {kTiffSamples, 5}}),
         "a TIFF of 16 bit and 5 samples a pixel, wanted 8 or 16 bit and 1 to 4 samples");
  expect(tiff({{kTiffWidth, 0}, {kTiffHeight, 480}, {kTiffBits, 8}}), "a picture of 0 x 480 pixels");
  // A strip or tile is allocated whole, whatever of it the picture needs; 2^32 - 1 rows mean one strip.
  EXPECT_EQ(
      read_tiff_header(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 8}, {kTiffRows, 0xFFFFFFFF}}))
          .status,
      PhotographStatus::ok);
  expect(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 8}, {kTiffRows, 1000000}}),
         "a TIFF with strips of 1000000 rows");
  expect(tiff({{kTiffWidth, 640},
               {kTiffHeight, 480},
               {kTiffBits, 8},
               {kTiffTileWidth, 65536},
               {kTiffTileHeight, 65536}}),
         "a TIFF with tiles of 65536 x 65536 pixels");
  expect(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 8}, {kTiffTileWidth, 64}}),
         "a TIFF with tiles of 64 x 0 pixels");
}

TEST(DecodedPhotographs, OfOtherKindsOrWithoutAPictureAreUnreadable) {
  const auto expect = [](const DecodedImage& image, const std::string& words) {
    EXPECT_EQ(image.status, PhotographStatus::unreadable) << words;
    EXPECT_EQ(image.reason, words);
    EXPECT_TRUE(image.grey.empty());
  };
  expect(decode_raster("GIF89a"), "neither JPEG, PNG nor TIFF");
  expect(decode_raw_green("GIF89a"), "neither NEF nor DNG");
  // Its head is that of a photograph, but no data follow.
  expect(decode_raster(tiff({{kTiffWidth, 640}, {kTiffHeight, 480}, {kTiffBits, 8}, {kTiffSamples, 1}})),
         "no image of 8 or 16 bit that can be decoded");
}

TEST(DecodedPhotographs, AJpegOfThousandsOfScansIsGivenUp) {
  std::vector<unsigned char> encoded;
  ASSERT_TRUE(cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC1, cv::Scalar(128)), encoded,
                           {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
  const std::string jpeg(encoded.begin(), encoded.end());
  ASSERT_EQ(decode_jpeg_luma(jpeg).status, PhotographStatus::ok) << decode_jpeg_luma(jpeg).reason;
  const std::size_t last_scan = jpeg.rfind("\xFF\xDA");
  const std::size_t end = jpeg.rfind("\xFF\xD9");
  ASSERT_LT(last_scan, end);
  std::string many = jpeg.substr(0, end);
  for (int i = 0; i < 2000; ++i) many += jpeg.substr(last_scan, end - last_scan);
  const DecodedImage image = decode_jpeg_luma(many + jpeg.substr(end));
  EXPECT_NE(image.status, PhotographStatus::ok);
  EXPECT_EQ(image.reason, "more than 100 scans");
}

TEST(DecodedPhotographs, AFileThatEndsBeforeItsSizeCannotBeRead) {
  // The kernel states a page for each of its files, and gives less.
  const std::filesystem::path path = "/sys/devices/system/cpu/online";
  std::error_code error;
  if (std::filesystem::file_size(path, error) != 4096 || error) GTEST_SKIP() << "without " << path;
  const Photograph photograph = read_photograph(path);
  EXPECT_EQ(photograph.status, PhotographStatus::unreadable);
  EXPECT_EQ(photograph.reason, "cannot be read");
}

TEST(DecodedPhotographs, OfAnotherSizeThanTheCamerasAreRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "small.png";
  ASSERT_TRUE(cv::imwrite(path.string(), cv::Mat(48, 64, CV_8UC1, cv::Scalar(128))));
  const CameraModel camera(640, 480, 900);
  const MarkerFamily& family = marker_family("tag36h11");
  EXPECT_EQ(observe_photograph(read_photograph(path), family, {}).status, PhotographStatus::ok);
  EXPECT_THAT([&] { (void)observe_photograph(read_photograph(path), family, {}, &camera); },
              ThrowsInputError("small.png: is 64 x 48 pixels, the camera file is for 640 x 480"));
}

TEST(MarkerFamilies, OfUnknownNamesAreRefusedWithTheKnownOnes) {
  EXPECT_THAT([] { (void)marker_family("tag0h0"); },
              ThrowsInputError("marker family 'tag0h0' is not known; wanted one of "));
  EXPECT_THAT([] { (void)marker_family(""); }, ThrowsInputError("tag36h11"));
}

}  // namespace
}  // namespace hexcal
