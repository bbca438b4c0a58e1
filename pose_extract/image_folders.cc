#include "pose_extract/image_folders.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <tuple>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/photograph/photograph_format.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Of files with one stem the format that stands first is taken: what the camera itself developed, then what
// people developed, then RAW.
int format_rank(const fs::path& path) {
  switch (photograph_format(path)) {
    case PhotographFormat::jpeg:
      return 0;
    case PhotographFormat::heif:
      return 1;
    case PhotographFormat::tiff:
      return 2;
    case PhotographFormat::png:
      return 3;
    case PhotographFormat::bmp:
      return 4;
    case PhotographFormat::nef:
      return 5;
    case PhotographFormat::other_raw:
      return 6;
    case PhotographFormat::dng:
      return 7;
    case PhotographFormat::none:
      break;
  }
  return -1;
}

bool is_litter(const fs::path& path) {
  static const std::set<std::string> kNames{"thumbs.db",
                                            "desktop.ini",
                                            "__macosx",
                                            "thumbnails",
                                            "thumbs",
                                            "results",
                                            "@eadir",
                                            "lost+found",
                                            "#recycle",
                                            "$recycle.bin",
                                            "system volume information"};
  const std::string name = path.filename().string();
  return name.empty() || name.front() == '.' || kNames.count(lower(name)) != 0;
}

// Folders that tell formats apart, as cameras and RAW developers make them: no poses.
bool is_format_folder(const fs::path& path) {
  static const std::set<std::string> kNames{"raw",  "nef",   "dng", "cr2",  "arw", "raf", "jpg",
                                            "jpeg", "jpegs", "tif", "tiff", "png", "bmp", "heic"};
  return kNames.count(lower(path.filename().string())) != 0;
}

bool is_thumbnail(const fs::path& path) {
  return lower(path.stem().string()).find("thumb") != std::string::npos;
}

bool name_less(const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); }

struct Folder {
  std::vector<fs::path> files;    // photographs directly in it
  std::vector<fs::path> unread;   // pictures in a format that is not read
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
    } else if (!unread_format_advice(entry.path()).empty()) {
      folder.unread.push_back(entry.path());
    }
  }
  std::sort(folder.unread.begin(), folder.unread.end(), name_less);
  std::sort(folder.files.begin(), folder.files.end(), name_less);
  std::sort(folder.folders.begin(), folder.folders.end(), name_less);
  return folder;
}

class Lister {
 public:
  Lister(const fs::path& root, const ListingOptions& options) : root_(root), options_(options) {}

  ImageListing list() {
    if (options_.table.empty()) {
      walk(root_, {}, "");
      set_strays_aside();
    } else {
      list_table();
    }
    for (auto& [key, files] : poses_) take_one_format(files);
    return finish();
  }

 private:
  struct Found {
    fs::path file;
    std::string camera;
    fs::path place;  // its folder, without the parts that only tell cameras or formats apart
    [[nodiscard]] auto exposure() const { return std::tuple(place, camera, lower(file.stem().string())); }
  };

  [[nodiscard]] std::string name(const fs::path& path) const {
    return printable_text(path.lexically_relative(root_).generic_string());
  }
  void skip(const fs::path& file, const std::string& reason) {
    listing_.skipped.push_back({name(file), reason});
  }

  [[nodiscard]] bool is_camera_folder(const fs::path& path) const {
    const std::string folder = path.filename().string();
    return std::find(options_.camera_folders.begin(), options_.camera_folders.end(), folder) !=
           options_.camera_folders.end();
  }

  // `key` is the pose: the folder's path without the parts that only tell cameras or formats apart.
  void walk(const fs::path& path, const fs::path& key, const std::string& camera) {
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    if (error || !visited_.insert(real).second) return;  // links may lead in a circle
    const Folder folder = read_folder(path);
    for (const fs::path& file : folder.unread) skip(file, unread_format_advice(file));
    for (const fs::path& file : folder.files) {
      if (is_thumbnail(file)) {
        skip(file, "a thumbnail by its name");
      } else {
        poses_[options_.one_heap ? fs::path() : key].push_back({file, camera, key});
      }
    }
    if (folder.folders.empty() && folder.files.empty() && !key.empty() && !options_.one_heap) {
      poses_[key];  // a pose whose photographs are missing
    }
    for (const fs::path& sub : folder.folders) {
      if (is_camera_folder(sub)) {
        walk(sub, key, sub.filename().string());
      } else {
        walk(sub, is_format_folder(sub) ? key : key / sub.filename(), camera);
      }
    }
  }

  // A photograph beside pose folders: at the top always, further down when it lies there alone.
  void set_strays_aside() {
    for (auto pose = poses_.begin(); pose != poses_.end();) {
      const fs::path& key = pose->first;
      const bool has_poses_below = std::any_of(poses_.begin(), poses_.end(), [&key](const auto& other) {
        return other.first != key &&
               (key.empty() ||
                std::mismatch(key.begin(), key.end(), other.first.begin(), other.first.end()).first ==
                    key.end());
      });
      if (!has_poses_below || (!key.empty() && pose->second.size() != 1)) {
        ++pose;
        continue;
      }
      for (const Found& found : pose->second)
        skip(found.file, "stray: it lies beside the pose folders, in none of them");
      pose = poses_.erase(pose);
    }
  }

  // One exposure counts once, however many formats it was saved in.
  void take_one_format(std::vector<Found>& files) {
    std::map<std::tuple<fs::path, std::string, std::string>, const Found*> best;
    for (const Found& found : files) {
      const Found*& chosen = best[found.exposure()];
      if (chosen == nullptr || format_rank(found.file) < format_rank(chosen->file)) chosen = &found;
    }
    std::vector<Found> taken;
    for (const Found& found : files) {
      const Found& chosen = *best.at(found.exposure());
      if (format_rank(found.file) == format_rank(chosen.file)) {
        taken.push_back(found);
      } else {
        skip(found.file,
             fmt::format("{} of {}, which is taken", is_raw(photograph_format(found.file)) ? "RAW" : "copy",
                         name(chosen.file)));
      }
    }
    files = std::move(taken);
  }

  void list_table() {
    std::map<std::string, fs::path> by_lower_name;
    const std::vector<fs::path> present = read_folder(root_).files;
    for (const fs::path& file : present) by_lower_name.emplace(lower(file.filename().string()), file);
    std::set<fs::path> listed;
    for (const auto& [file, pose] : options_.table) {
      fs::path path = root_ / file;
      const auto other_case = by_lower_name.find(lower(file));
      if (!fs::exists(path) && other_case != by_lower_name.end()) path = other_case->second;
      if (!listed.insert(path).second) {
        skip(path, fmt::format("named twice in the table of images; not taken for pose {}", pose));
        continue;
      }
      poses_[pose].push_back(
          {path, "", path.parent_path()});  // a missing file becomes its photograph's status
    }
    for (const fs::path& file : present) {
      if (listed.count(file) == 0) skip(file, "stray: not named in the table of images");
    }
  }

  ImageListing finish() {
    std::map<std::string, int> times;
    for (const auto& [key, files] : poses_) ++times[key.filename().string()];
    for (const auto& [key, files] : poses_) {
      const fs::path named = key.empty() ? fs::absolute(root_).lexically_normal() : key;
      const std::string last = named.filename().string();
      const bool alone = times[last] <= 1 && options_.table.empty();
      const std::string id = printable_text(alone ? last : named.generic_string());
      listing_.poses.push_back(id);
      for (const Found& found : files)
        listing_.images.push_back({found.file, name(found.file), id, found.camera});
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
  std::map<fs::path, std::vector<Found>> poses_;
  std::set<fs::path> visited_;
};

}  // namespace

bool is_photograph_name(const fs::path& path) { return format_rank(path) >= 0; }

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
  fs::path root = folder.lexically_normal();
  if (root.filename().empty()) root = root.parent_path();  // a slash at the end
  return Lister(root, options).list();
}

std::vector<ImagePlace> places_of_names(const std::vector<std::string>& names,
                                        const std::vector<std::string>& camera_folders) {
  std::vector<ImagePlace> places(names.size());
  std::vector<fs::path> keys(names.size());
  std::map<std::string, std::set<fs::path>> keys_with_name;
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const fs::path& part : fs::path(names[i]).parent_path()) {
      if (std::find(camera_folders.begin(), camera_folders.end(), part.string()) != camera_folders.end()) {
        places[i].camera_folder = part.string();
      } else if (!is_format_folder(part)) {
        keys[i] /= part;
      }
    }
    keys_with_name[keys[i].filename().string()].insert(keys[i]);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string last = keys[i].filename().string();
    places[i].pose = keys_with_name[last].size() == 1 ? last : keys[i].generic_string();
  }
  return places;
}

}  // namespace hexcal
