#include "tools/io/row_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <future>
#include <optional>
#include <unordered_set>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/photograph/input_file.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_dialect.h"
#include "tools/io/number_range.h"
#include "tools/io/output_file.h"
#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock = std::size_t{1} << 22;
// Ids beyond are not looked for among the others: memory. A hash of 64 bits tells these apart.
constexpr std::size_t kMostIds = 500'000;
constexpr std::size_t kLongestLine = std::size_t{1} << 20;

// Splits a line at its separators; quoted fields may hold them. Quotes are taken off, doubled ones within are
// kept in `unquoted` storage. False where a quote is not closed, or something stands behind it.
bool split(std::string_view line, char separator, std::vector<std::string_view>& fields,
           std::vector<std::string>& unquoted) {
  fields.clear();
  unquoted.clear();
  unquoted.reserve(32);  // views into the strings must stay where they are
  std::size_t at = 0;
  while (true) {
    std::size_t end = line.find(separator, at);
    const std::size_t first = line.find_first_not_of(' ', at);
    if (first != std::string_view::npos && line[first] == '"' && unquoted.size() < 32) {
      std::string text;
      std::size_t i = first + 1;
      for (; i < line.size(); ++i) {
        if (line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"') {
          text += line[i++];
        } else if (line[i] == '"') {
          break;
        } else {
          text += line[i];
        }
      }
      end = line.find(separator, i);
      if (i == line.size() ||
          !trimmed(line.substr(i + 1, end == std::string_view::npos ? end : end - i - 1)).empty())
        return false;
      unquoted.push_back(std::move(text));
      fields.push_back(unquoted.back());
    } else {
      fields.push_back(trimmed(line.substr(at, end == std::string_view::npos ? end : end - at)));
    }
    if (end == std::string_view::npos) return true;
    at = end + 1;
  }
}

bool is_content(std::string_view line) {
  const std::string_view text = trimmed(line);
  return !text.empty() && text.front() != '#';
}

[[noreturn]] void refuse_quotes(const fs::path& path, std::size_t line) {
  throw InputError(
      fmt::format("{}:{}: a quote is not closed, or text stands behind it", path.string(), line));
}

// Where the wanted columns stand.
struct Layout {
  std::size_t id = 0;
  std::vector<std::size_t> numbers;
  std::size_t fields = 0;
  char separator = ',';
};

Layout layout_of(std::string_view header, const fs::path& path, std::size_t line,
                 const RowTransform& transform) {
  std::vector<std::string_view> names;
  std::vector<std::string> storage;
  Layout layout;
  layout.separator = csv_separator(header);
  if (!split(header, layout.separator, names, storage)) refuse_quotes(path, line);
  const auto find = [&](const std::string& wanted) {
    const auto first = std::find(names.begin(), names.end(), wanted);
    if (first != names.end() && std::find(first + 1, names.end(), wanted) != names.end())
      throw InputError(fmt::format("{}:{}: column '{}' stands twice", path.string(), line, wanted));
    if (first != names.end()) return static_cast<std::size_t>(first - names.begin());
    std::string found;
    for (const std::string_view n : names) found += fmt::format("{}{}", found.empty() ? "" : ",", n);
    throw InputError(
        fmt::format("{}:{}: found columns {}, wanted a column '{}'", path.string(), line, found, wanted));
  };
  layout.id = find(transform.id_column);
  for (const std::string& column : transform.columns) layout.numbers.push_back(find(column));
  layout.fields = names.size();
  return layout;
}

struct Piece {
  std::string out;
  std::vector<std::pair<std::size_t, std::size_t>> ids;  // hash and line of each
  StreamTally tally;
};

// All whole lines of `text`; the first is line `first_line` of the file.
Piece transformed(std::string_view text, std::size_t first_line, const fs::path& path, const Layout& layout,
                  const RowTransform& transform) {
  Piece piece;
  piece.out.reserve(text.size() * 2);
  std::vector<std::string_view> fields;
  std::vector<std::string> storage;
  std::vector<double> numbers(layout.numbers.size());
  for (std::size_t line = first_line; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    const std::string_view row = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!is_content(row)) continue;
    if (!split(row, layout.separator, fields, storage)) refuse_quotes(path, line);
    if (fields.size() != layout.fields) {
      throw InputError(fmt::format("{}:{}: found {} fields, wanted {} as in the header", path.string(), line,
                                   fields.size(), layout.fields));
    }
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const std::string_view field = trimmed(fields[layout.numbers[k]]);
      const auto number = csv_number(field, layout.separator);
      if (!number) {
        throw InputError(fmt::format("{}:{}: {}: found '{}', wanted a number", path.string(), line,
                                     transform.columns[k], field));
      }
      std::string fault;
      numbers[k] = ranged_number(transform.columns[k], *number, fault);
      if (!fault.empty())
        throw InputError(fmt::format("{}:{}: {}: {}", path.string(), line, transform.columns[k], fault));
    }
    const std::string printable_id = printable_text(fields[layout.id]);
    const std::string_view id = printable_id;
    if (id.empty())
      throw InputError(
          fmt::format("{}:{}: {}: is empty, wanted a pose id", path.string(), line, transform.id_column));
    piece.ids.push_back({std::hash<std::string_view>{}(id), line});
    ++piece.tally.rows;
    if (!transform.row({id, numbers}, piece.out) && ++piece.tally.failed == 1) piece.tally.first_failed = id;
  }
  return piece;
}

// The input's bytes in blocks, from a file or from a pipe that has been read.
class BlockReader {
 public:
  explicit BlockReader(const fs::path& path) : path_(path) {
    if (is_handed_pipe(path)) {
      kept_ = read_file(path);
    } else {
      file_.emplace(path);
      check();
      std::array<char, 2> first{};
      const bool recoded = begins_as_utf16({first.data(), file_->read(first.data(), first.size())});
      file_->rewind();
      if (recoded) {
        sha256_ = sha256();
        kept_ = csv_as_utf8(read_file(path));
        file_.reset();
      }
    }
  }
  // Hash of all of it, before the first block is read.
  std::string sha256() {
    if (!file_) return sha256_.empty() ? sha256_hex(kept_) : sha256_;
    Sha256 hash;
    std::string block(kBlock, '\0');
    while (const std::size_t count = file_->read(block.data(), block.size()))
      hash.add(std::string_view(block).substr(0, count));
    check();
    file_->rewind();
    return hash.hex();
  }
  std::size_t read(char* to, std::size_t wanted) {
    if (!file_) {
      const std::size_t count = kept_.copy(to, wanted, at_);
      at_ += count;
      return count;
    }
    const std::size_t count = file_->read(to, wanted);
    check();
    return count;
  }

 private:
  void check() const {
    if (!file_->failure().empty()) throw InputError(fmt::format("{}: {}", path_.string(), file_->failure()));
  }

  fs::path path_;
  std::optional<InputFile> file_;
  std::string kept_;
  std::string sha256_;  // of the file where kept_ was recoded
  std::size_t at_ = 0;
};

}  // namespace

void append_number(std::string& out, double value, int decimals) {
  std::array<char, 400> text;
  const auto result =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  std::string_view printed(text.data(), static_cast<std::size_t>(result.ptr - text.data()));
  // No minus before a zero.
  if (!printed.empty() && printed.front() == '-' &&
      printed.find_first_not_of("-0.") == std::string_view::npos)
    printed.remove_prefix(1);
  out += printed;
}

StreamTally stream_rows(const fs::path& input, const fs::path& output, const std::string& head,
                        const RowTransform& transform, int threads) {
  BlockReader in(input);
  remove_abandoned_files(output.has_parent_path() ? output.parent_path() : ".", output.filename().string());
  OutputFile out(output,
                 fmt::format("{}  {} sha256:{}\n{}", head,
                             is_handed_pipe(input) ? "pipe" : printable_text(input.filename().string()),
                             in.sha256(), transform.header));

  std::size_t line = 1;
  std::string name;
  bool has_header = false;
  Layout layout;
  StreamTally tally;
  std::unordered_set<std::size_t> seen;
  std::string block;
  while (true) {
    // What is left of the last block, then whole lines.
    const std::size_t kept = block.size();
    block.resize(kept + kBlock);
    const std::size_t count = in.read(block.data() + kept, kBlock);
    const bool last = count < kBlock;
    block.resize(kept + count);
    if (!has_header && line == 1 && block.starts_with("\xEF\xBB\xBF")) block.erase(0, 3);
    const std::size_t cut = last ? block.size() : block.rfind('\n') + 1;
    if (cut == 0 && block.size() > kLongestLine)
      throw InputError(fmt::format("{}:{}: the line is too long", input.string(), line));
    std::string_view text(block.data(), cut);
    while (!has_header && !text.empty()) {
      const std::size_t end = text.find('\n');
      const std::string_view row = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (is_content(row)) {
        layout = layout_of(row, input, line, transform);
        has_header = true;
      }
      ++line;
    }
    // Equal shares of the block, cut at line ends; written in order.
    std::vector<std::future<Piece>> pieces;
    for (int t = threads; t >= 1; --t) {
      const std::size_t wanted = text.size() / static_cast<std::size_t>(t);
      const std::size_t end = t == 1 ? std::string_view::npos : text.find('\n', wanted);
      const std::string_view share = text.substr(0, end == std::string_view::npos ? end : end + 1);
      text.remove_prefix(share.size());
      const auto work = [share, line, &input, &layout, &transform] {
        return transformed(share, line, input, layout, transform);
      };
      pieces.push_back(std::async(t == 1 ? std::launch::deferred : std::launch::async, work));
      line += static_cast<std::size_t>(std::count(share.begin(), share.end(), '\n'));
    }
    // The last share is worked on here, beside the others; an error in an earlier line is told first.
    pieces.back().wait();
    for (std::future<Piece>& piece : pieces) {
      const Piece done = piece.get();
      for (const auto& [id, at] : done.ids) {
        if (seen.size() < kMostIds && !seen.insert(id).second)
          throw InputError(
              fmt::format("{}:{}: this {} stands twice", input.string(), at, transform.id_column));
      }
      out.write(done.out);
      if (tally.failed == 0) tally.first_failed = done.tally.first_failed;
      tally.rows += done.tally.rows;
      tally.failed += done.tally.failed;
    }
    if (last) break;
    block.erase(0, cut);
  }
  if (!has_header) throw InputError(fmt::format("{}: is empty, wanted a header line", input.string()));
  out.flush();
  out.rename_to_target();
  return tally;
}

}  // namespace hexcal
