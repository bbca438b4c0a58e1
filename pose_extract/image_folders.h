#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace hexcal {

/// A photograph of a campaign and the pose it shows.
struct CampaignImage {
  std::filesystem::path path;
  std::string name;    ///< relative to the image folder, with '/'
  std::string pose;    ///< pose id
  std::string folder;  ///< name of the camera folder it lies in; empty if none
};

/// A file that is not measured, and why.
struct SkippedFile {
  std::string name;
  std::string reason;
};

struct ImageListing {
  std::vector<std::string> poses;     ///< in natural order (2 before 10), also those without photographs
  std::vector<CampaignImage> images;  ///< by pose, then natural order of names
  std::vector<SkippedFile> skipped;
};

struct ListingOptions {
  /// Folders of these names, above or below the poses', tell cameras apart and are not poses.
  std::vector<std::string> camera_folders;
  /// (file, pose) for photographs in one flat folder; empty: folders are poses.
  std::vector<std::pair<std::string, std::string>> table;
  bool one_heap = false;  ///< folders mean nothing (a memory card): all photographs are one pose
};

/// True for names such as DSC_0001.JPG, img.tiff, x.nef, in any case.
[[nodiscard]] bool is_photograph_name(const std::filesystem::path& path);

/// Lists the photographs below `folder`. A pose is a folder that holds photographs, whatever lies above it,
/// with those of its sub-folders that only tell cameras (options) or formats (raw, jpg, ...) apart; its id is
/// the folder's name, or its path where two have the same name. A folder without sub-folders is one pose.
/// Hidden files, thumbnails' folders and the litter of operating systems are passed over in silence. Of an
/// exposure in several formats one is taken: JPEG, then HEIC, TIFF, PNG, BMP, RAW. Photographs beside pose
/// folders are named as stray. A file of the table that does not exist is listed, for its status to say so.
/// Throws InputError if the folder does not exist.
[[nodiscard]] ImageListing list_images(const std::filesystem::path& folder, const ListingOptions& options);

/// What a name relative to the image folder says: the pose, and the folder that tells its camera (empty:
/// none).
struct ImagePlace {
  std::string pose;
  std::string camera_folder;
};

/// The places of names by the rule of list_images, for observations whose photographs are not at hand. A name
/// without a folder has an empty pose.
[[nodiscard]] std::vector<ImagePlace> places_of_names(const std::vector<std::string>& names,
                                                      const std::vector<std::string>& camera_folders);

/// Natural order: runs of digits compare as numbers.
[[nodiscard]] bool natural_less(const std::string& a, const std::string& b);

}  // namespace hexcal
