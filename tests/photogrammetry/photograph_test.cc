#include <gmock/gmock.h>
#include <libheif/heif.h>

#include <cstdint>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "photogrammetry/markers/detect.h"
#include "photogrammetry/photograph/decoders.h"
#include "photogrammetry/photograph/linear_tone.h"
#include "photogrammetry/photograph/photograph_format.h"
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
  expect(decode_raster("GIF89a"), "neither JPEG, PNG, TIFF, BMP nor HEIC");
  expect(decode_raw_green("GIF89a"), "not a RAW file (NEF, DNG, CR2, ARW or RAF)");
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

TEST(DecodedPhotographs, AFileOfTheKernelIsNotOpened) {
  const std::filesystem::path path = "/sys/devices/system/cpu/online";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "without " << path;
  const Photograph photograph = read_photograph(path);
  EXPECT_EQ(photograph.status, PhotographStatus::unreadable);
  EXPECT_EQ(photograph.reason, "belongs to the kernel, wanted a file");
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

std::string encoded(const char* ending, const cv::Mat& picture) {
  std::vector<unsigned char> bytes;
  EXPECT_TRUE(cv::imencode(ending, picture, bytes));
  return {bytes.begin(), bytes.end()};
}

// Black squares on white as a sensor sees them: photons' noise; 16 bit.
cv::Mat noisy_squares(bool linear, double electrons) {
  cv::Mat light(400, 600, CV_32FC1, cv::Scalar(0.7));
  for (int y = 30; y + 60 < light.rows; y += 90) {
    for (int x = 30; x + 60 < light.cols; x += 90) light(cv::Rect(x, y, 60, 60)).setTo(0.04);
  }
  cv::GaussianBlur(light, light, {0, 0}, 0.9);
  cv::Mat noise(light.size(), CV_32FC1);
  cv::theRNG().state = 7;
  cv::randn(noise, 0, 1);
  cv::Mat sigma;
  cv::sqrt(light / electrons + 1e-6, sigma);
  light += noise.mul(sigma);
  cv::Mat value = light;
  if (!linear) {
    cv::pow(cv::max(light, 0), 1 / 2.4, value);
    value = 1.055 * value - 0.055;
  }
  cv::Mat out;
  value.convertTo(out, CV_16UC1, 65535);
  return out;
}

TEST(LinearTone, OfSixteenBitsIsToldByTheNoise) {
  for (const char* ending : {".png", ".tiff"}) {
    for (const bool linear : {true, false}) {
      for (const double electrons : {2000.0, 30000.0}) {
        const DecodedImage image = decode_raster(encoded(ending, noisy_squares(linear, electrons)));
        ASSERT_EQ(image.status, PhotographStatus::ok) << image.reason;
        EXPECT_EQ(image.tone, linear ? ToneCurve::linear : ToneCurve::srgb) << ending << " " << electrons;
      }
    }
  }
  // Underexposed by two stops, as converters of RAW files leave it.
  EXPECT_EQ(judged_tone("", noisy_squares(true, 8000) / 4), ToneCurve::linear);
  // Without different levels or without noise nothing is told, and 8 bits are never linear.
  EXPECT_EQ(judged_tone("", cv::Mat(300, 300, CV_16UC1, cv::Scalar(9000))), ToneCurve::srgb);
  cv::Mat smooth;
  cv::GaussianBlur(noisy_squares(true, 8000), smooth, {0, 0}, 30);
  EXPECT_EQ(judged_tone("", smooth), ToneCurve::srgb);
  cv::Mat eight;
  noisy_squares(true, 8000).convertTo(eight, CV_8U, 1 / 257.0);
  EXPECT_EQ(decode_raster(encoded(".png", eight)).tone, ToneCurve::srgb);
}

TEST(LinearTone, IsWhatAPngsGammaSays) {
  std::string png_bytes = encoded(".png", noisy_squares(false, 8000));
  const std::string gamma = std::string("\0\0\0\x04gAMA", 8) + big_endian(100000) + std::string(4, '\0');
  png_bytes.insert(33, gamma);  // after IHDR; no reader here checks its sum
  EXPECT_EQ(judged_tone(png_bytes, noisy_squares(false, 8000)), ToneCurve::linear);
}

TEST(DecodedPhotographs, BitmapsAreRead) {
  cv::Mat grey(48, 67, CV_8UC1);
  cv::randu(grey, 0, 255);
  const std::string bmp = encoded(".bmp", grey);
  const DecodedImage image = decode_raster(bmp);
  ASSERT_EQ(image.status, PhotographStatus::ok) << image.reason;
  EXPECT_EQ(cv::norm(image.grey, grey, cv::NORM_INF), 0);
  EXPECT_EQ(decode_raster(bmp.substr(0, bmp.size() - 100)).status, PhotographStatus::truncated);
  std::string huge = bmp;
  huge.replace(18, 8, std::string("\xFF\xFF\x00\x00\xFF\xFF\x00\x00", 8));
  EXPECT_EQ(decode_raster(huge).status, PhotographStatus::too_large);
  std::string odd = bmp;
  odd[28] = 4;
  EXPECT_THAT(decode_raster(odd).reason, HasSubstr("a BMP of 4 bit"));
  EXPECT_THAT(decode_raster("BM").reason, HasSubstr("without a whole header"));
}

// A HEIC file as a phone makes it; empty where libheif has no encoder.
std::string heic(const cv::Mat& luma) {
  heif_context* context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  std::string out;
  if (heif_context_get_encoder_for_format(context, heif_compression_HEVC, &encoder).code == heif_error_Ok) {
    heif_encoder_set_lossy_quality(encoder, 95);
    heif_image* picture = nullptr;
    heif_image_create(luma.cols, luma.rows, heif_colorspace_YCbCr, heif_chroma_420, &picture);
    const auto fill = [&](heif_channel channel, int width, int height) {
      heif_image_add_plane(picture, channel, width, height, 8);
      int stride = 0;
      std::uint8_t* plane = heif_image_get_plane(picture, channel, &stride);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          plane[y * stride + x] = channel == heif_channel_Y ? luma.at<std::uint8_t>(y, x) : 128;
        }
      }
    };
    fill(heif_channel_Y, luma.cols, luma.rows);
    fill(heif_channel_Cb, luma.cols / 2, luma.rows / 2);
    fill(heif_channel_Cr, luma.cols / 2, luma.rows / 2);
    heif_context_encode_image(context, picture, encoder, nullptr, nullptr);
    heif_writer writer{};
    writer.writer_api_version = 1;
    writer.write = [](heif_context*, const void* data, std::size_t size, void* to) {
      static_cast<std::string*>(to)->append(static_cast<const char*>(data), size);
      return heif_error{heif_error_Ok, heif_suberror_Unspecified, ""};
    };
    heif_context_write(context, &writer, &out);
    heif_image_release(picture);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return out;
}

TEST(DecodedPhotographs, HeicOfAPhoneIsRead) {
  cv::Mat luma(240, 320, CV_8UC1);
  for (int y = 0; y < luma.rows; ++y) {
    for (int x = 0; x < luma.cols; ++x)
      luma.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(40 + x / 2 + y / 8);
  }
  luma(cv::Rect(100, 80, 90, 70)).setTo(30);
  const std::string bytes = heic(luma);
  if (bytes.empty()) GTEST_SKIP() << "libheif has no HEVC encoder";
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "IMG_0001.HEIC";
  std::ofstream(path, std::ios::binary) << bytes;
  const Photograph photograph = read_photograph(path);
  ASSERT_EQ(photograph.status, PhotographStatus::ok) << photograph.reason;
  EXPECT_EQ(photograph.grey.size(), luma.size());
  EXPECT_LT(cv::norm(photograph.grey, luma, cv::NORM_L1) / static_cast<double>(luma.total()), 2);
  EXPECT_EQ(read_photograph_info(path).width_px, 320);
  std::ofstream(path, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  const Photograph cut = read_photograph(path);
  EXPECT_NE(cut.status, PhotographStatus::ok);
  EXPECT_FALSE(cut.reason.empty());
}

TEST(RawPhotographs, AreCroppedAsTheCameraCropsItsJpegs) {
  const cv::Size shown(6034, 4012);
  const cv::Rect d3200(9, 6, 6016, 4000);
  EXPECT_EQ(jpeg_crop("Nikon", "D3200", {0, 0}, shown), d3200);
  EXPECT_EQ(jpeg_crop("Nikon", "D3200", {6016, 4000}, shown), d3200);
  EXPECT_EQ(jpeg_crop("Nikon", "D3200", {640, 424}, shown), d3200);  // a small preview tells nothing
  EXPECT_EQ(jpeg_crop("Canon", "EOS 6D", {5472, 3648}, {5496, 3670}), cv::Rect(12, 11, 5472, 3648));
  EXPECT_EQ(jpeg_crop("Canon", "EOS 6D", {0, 0}, {5496, 3670}), cv::Rect(0, 0, 5496, 3670));
}

TEST(PhotographFormat, GoesByTheEndingAndNamesWhatIsNotRead) {
  EXPECT_EQ(photograph_format("a/B.HEIC"), PhotographFormat::heif);
  EXPECT_TRUE(is_raw(photograph_format("x.CR2")));
  EXPECT_EQ(photograph_format("x.cr3"), PhotographFormat::none);
  EXPECT_EQ(unread_format_advice("x.cr3"), "CR3 is not read: save it as JPEG or 16-bit TIFF");
  EXPECT_EQ(unread_format_advice("notes.txt"), "");
  EXPECT_EQ(unread_format_advice("x.jpg"), "");
}

}  // namespace
}  // namespace hexcal
