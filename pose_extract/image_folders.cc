#include "pose_extract/image_folders.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "kinematics/geometry/input_error.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string extension(const fs::path& path) { return lower(path.extension().string()); }

bool is_raw(const fs::path& path) { return extension(path) == ".nef" || extension(path) == ".dng"; }

bool is_litter(const fs::path& path) {
  static const std::set<std::string> kNames{"thumbs.db", "desktop.ini", "__macosx", "thumbnails",
                                            "thumbs",    "results",     "@eadir",   "lost+found"};
  const std::string name = path.filename().string();
  return name.empty() || name.front() == '.' || kNames.count(lower(name)) != 0;
}

bool name_less(const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); }

struct Folder {
  std::vector<fs::path> files;    // photographs directly in it
  std::vector<fs::path> folders;  // its sub-folders
};

Folder read_folder(const fs::path& path) {
  Folder folder;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    if (is_litter(entry.path())) continue;
    std::error_code ignored;
    if (entry.is_directory(ignored)) {
      folder.folders.push_back(entry.path());
    } else if (is_photograph_name(entry.path())) {
      folder.files.push_back(entry.path());
    }
  }
  std::sort(folder.files.begin(), folder.files.end(), name_less);
  std::sort(folder.folders.begin(), folder.folders.end(), name_less);
  return folder;
}

class Lister {
 public:
  Lister(const fs::path& root, const ListingOptions& options) : root_(root), options_(options) {}

  ImageListing list() {
    const Folder top = read_folder(root_);
    if (!options_.table.empty()) {
      list_table();
    } else if (top.folders.empty()) {
      add_pose(root_, top.files, "");
    } else {
      for (const fs::path& file : top.files)
        skip(file, "stray: it lies beside the pose folders, in none of them");
      for (const fs::path& folder : top.folders) walk(folder);
    }
    return finish();
  }

 private:
  struct Pending {
    fs::path folder;  // gives the pose its id
    fs::path file;
    std::string camera;
  };

  [[nodiscard]] std::string name(const fs::path& path) const {
    return path.lexically_relative(root_).generic_string();
  }
  void skip(const fs::path& file, const std::string& reason) {
    listing_.skipped.push_back({name(file), reason});
  }

  [[nodiscard]] bool is_camera_folder(const fs::path& path) const {
    const std::string folder = path.filename().string();
    return std::find(options_.camera_folders.begin(), options_.camera_folders.end(), folder) !=
           options_.camera_folders.end();
  }

  void walk(const fs::path& path) {
    const Folder folder = read_folder(path);
    const bool has_cameras = std::any_of(folder.folders.begin(), folder.folders.end(),
                                         [&](const fs::path& sub) { return is_camera_folder(sub); });
    if (!folder.files.empty() || has_cameras || folder.folders.empty()) add_pose(path, folder.files, "");
    for (const fs::path& sub : folder.folders) {
      if (is_camera_folder(sub)) {
        add_pose(path, read_folder(sub).files, sub.filename().string());
      } else {
        walk(sub);
      }
    }
  }

  void add_pose(const fs::path& path, const std::vector<fs::path>& files, const std::string& camera) {
    folders_.insert(path);
    std::map<std::string, std::string> chosen;  // stem -> the name that is taken
    for (const fs::path& file : files) {
      if (!is_raw(file)) chosen.emplace(lower(file.stem().string()), file.filename().string());
    }
    for (const fs::path& file : files) {
      const auto beside = chosen.find(lower(file.stem().string()));
      if (is_raw(file) && beside != chosen.end()) {
        skip(file, fmt::format("RAW of {}, which is taken", beside->second));
      } else {
        pending_.push_back({path, file, camera});
      }
    }
  }

  void list_table() {
    std::set<std::string> poses;
    std::set<fs::path> listed;
    for (const auto& [file, pose] : options_.table) {
      const fs::path path = root_ / file;
      if (!fs::exists(path)) {
        throw InputError(fmt::format("{}: no such photograph, named in the table of images for pose {}",
                                     path.string(), pose));
      }
      poses.insert(pose);
      listed.insert(path);
      listing_.images.push_back({path, name(path), pose, ""});
    }
    listing_.poses.assign(poses.begin(), poses.end());
    for (const fs::path& file : read_folder(root_).files) {
      if (listed.count(file) == 0) skip(file, "stray: not named in the table of images");
    }
  }

  ImageListing finish() {
    std::map<std::string, int> times;
    for (const fs::path& folder : folders_) ++times[folder.filename().string()];
    std::map<fs::path, std::string> ids;
    for (const fs::path& folder : folders_) {
      const std::string last = folder.filename().string();
      ids[folder] = times[last] > 1 ? name(folder) : last;
      listing_.poses.push_back(ids[folder]);
    }
    for (const Pending& image : pending_) {
      listing_.images.push_back({image.file, name(image.file), ids[image.folder], image.camera});
    }
    std::sort(listing_.poses.begin(), listing_.poses.end(), natural_less);
    std::stable_sort(listing_.images.begin(), listing_.images.end(),
                     [](const CampaignImage& a, const CampaignImage& b) {
                       return a.pose != b.pose ? natural_less(a.pose, b.pose) : natural_less(a.name, b.name);
                     });
    return std::move(listing_);
  }

  fs::path root_;
  const ListingOptions& options_;
  ImageListing listing_;
  std::set<fs::path> folders_;
  std::vector<Pending> pending_;
};

}  // namespace

bool is_photograph_name(const fs::path& path) {
  static const std::set<std::string> kExtensions{".jpg", ".jpeg", ".png", ".tif", ".tiff", ".nef", ".dng"};
  return kExtensions.count(extension(path)) != 0;
}

bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0;
  std::size_t j = 0;
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      const auto number = [&digit](const std::string& text, std::size_t& at) {
        while (at + 1 < text.size() && text[at] == '0' && digit(text[at + 1])) ++at;
        const std::size_t begin = at;
        while (at < text.size() && digit(text[at])) ++at;
        return text.substr(begin, at - begin);
      };
      const std::string m = number(a, i);
      const std::string n = number(b, j);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

ImageListing list_images(const fs::path& folder, const ListingOptions& options) {
  if (!fs::is_directory(folder)) {
    throw InputError(fmt::format("{}: no such folder, wanted one with a sub-folder of photographs per pose",
                                 folder.string()));
  }
  return Lister(folder.lexically_normal(), options).list();
}

}  // namespace hexcal
