#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/error_matchers.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/output_file.h"
#include "tools/io/pose_table.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

TEST(AtomicFile, WritesReadsAndReplaces) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "sub" / "a.txt";
  write_file_atomically(path, "one");
  write_file_atomically(path, "two");
  EXPECT_EQ(read_file(path), "two");
  EXPECT_EQ(std::distance(fs::directory_iterator(path.parent_path()), fs::directory_iterator()), 1);
}

TEST(AtomicFile, NamesTheFileItCannotReadOrWrite) {
  const TemporaryFolder folder;
  EXPECT_THAT([&] { (void)read_file(folder.path() / "none.yaml"); },
              ThrowsInputError("none.yaml: no such file"));
  EXPECT_THAT([&] { (void)read_file(folder.path()); }, ThrowsInputError("is a folder, wanted a file"));
  EXPECT_THAT([&] { write_file_atomically(folder.path(), "x"); }, ThrowsInputError("is a folder"));
  std::ofstream(folder.path() / "file") << "x";
  EXPECT_THAT([&] { write_file_atomically(folder.path() / "file" / "below.txt", "x"); },
              ThrowsInputError("cannot create"));
}

TEST(AtomicFile, HashesAsEveryoneDoes) {
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(AtomicFile, ProvenanceNamesInputsWithoutTheirFolders) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "in.csv", "abc");
  EXPECT_EQ(provenance_line("1.2.3", "evaluate", {folder.path() / "in.csv", folder.path() / "none"}),
            "# hexcal 1.2.3  evaluate  in.csv "
            "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad\n");
}

TEST(Yaml, ReadsWhatIsThere) {
  const YamlMap map =
      YamlMap::parse("a: 1.5\nb: [1, 2, 3]\nc: {xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 90]}\nd: 7\n", "f.yaml");
  EXPECT_EQ(map.number("a"), 1.5);
  EXPECT_EQ(map.vector3("b"), Eigen::Vector3d(1, 2, 3));
  EXPECT_LE((map.rigid3("c").rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_EQ(map.numbers_or_one("d", 2), (std::vector<double>{7, 7}));
  EXPECT_NO_THROW(map.finish());
}

TEST(Yaml, NamesLineAndKey) {
  const YamlMap map = YamlMap::parse("a: 1\nsize_mn: 24\nsub:\n  x: word\n", "f.yaml");
  EXPECT_EQ(map.number("a"), 1);
  EXPECT_THAT([&] { (void)map.number("size_mm"); },
              ThrowsInputError("f.yaml:1: size_mm: missing, wanted a number"));
  EXPECT_THAT([&] { (void)map.map("sub").number("x"); },
              ThrowsInputError("f.yaml:4: sub.x: found 'word', wanted a number"));
  EXPECT_THAT([&] { map.finish(); },
              ThrowsInputError("f.yaml:2: unknown key 'size_mn'; did you mean 'size_mm'?"));
}

TEST(Yaml, RefusesWhatIsNotAMapping) {
  EXPECT_THAT([] { (void)YamlMap::parse("a: [1, 2", "f.yaml"); }, ThrowsInputError("not valid YAML"));
  EXPECT_THAT([] { (void)YamlMap::parse("- 1\n", "f.yaml"); }, ThrowsInputError("wanted keys and values"));
  EXPECT_THAT(
      [] {
        const YamlMap map = YamlMap::parse("a: 1\na: 2\n", "f.yaml");
        (void)map.number("a");
        map.finish();
      },
      ThrowsInputError("f.yaml:2: key 'a' stands twice"));
  EXPECT_THAT([] { (void)YamlMap::parse("a: .nan\n", "f.yaml").number("a"); },
              ThrowsInputError("wanted a number"));
}

TEST(Csv, ReadsQuotesCommentsAndWindowsLines) {
  const CsvTable table =
      CsvTable::parse("\xEF\xBB\xBF# head\r\nid, x_mm\r\n\"a,b\",1.5\r\n\r\nc,-2\r\n", "t.csv");
  ASSERT_EQ(table.rows(), 2U);
  EXPECT_EQ(table.text(0, "id"), "a,b");
  EXPECT_EQ(table.number(1, "x_mm"), -2);
  EXPECT_THAT(table.comments(), testing::ElementsAre("# head"));
}

// The same table as an English, a German and a Unicode spreadsheet saves it.
TEST(Csv, ReadsWhatSpreadsheetsWrite) {
  const std::string semicolons = "id;x_mm;note\n a ;-1,5;\"1;2\"\nb;2e3;\n";
  std::string utf16le = "\xFF\xFE";
  std::string utf16be = "\xFE\xFF";
  std::string tabs;
  std::string old_mac;
  for (const char c : semicolons) {
    utf16le += {c, '\0'};
    utf16be += {'\0', c};
    old_mac += c == '\n' ? '\r' : c;
    tabs += c == ';' ? '\t' : c;
  }
  for (const std::string& text :
       {semicolons, utf16le, utf16be, old_mac, "\xEF\xBB\xBF" + semicolons, tabs,
        "\"# hexcal, a comment with commas\";;\n" + semicolons, "# comment;;\n" + semicolons + ";;\n"}) {
    const CsvTable table = CsvTable::parse(text, "t.csv");
    EXPECT_THAT(table.columns(), testing::ElementsAre("id", "x_mm", "note")) << text;
    ASSERT_EQ(table.rows(), 2U) << text;
    EXPECT_EQ(table.text(0, "id"), "a") << text;
    EXPECT_EQ(table.number(0, "x_mm"), -1.5) << text;
    EXPECT_EQ(table.number(1, "x_mm"), 2000) << text;
  }
  EXPECT_EQ(CsvTable::parse("id;x_mm;;\n\xC3\xA4;1;;\n", "t.csv").text(0, "id"), "\xC3\xA4");
  EXPECT_EQ(CsvTable::parse(std::string("\xFF\xFEi\0d\0\n\0\xE4\0", 10), "t.csv").text(0, "id"), "\xC3\xA4");
  // Thousands are not guessed at, and with commas between fields a decimal comma is another field.
  EXPECT_THAT([] { (void)CsvTable::parse("a;b\n1.234,5;2\n", "t.csv").number(0, "a"); },
              ThrowsInputError("'1.234,5' is not a number"));
  EXPECT_THAT([] { (void)CsvTable::parse("a,b\n1,5,2\n", "t.csv"); },
              ThrowsInputError("found 3 fields, wanted 2"));
}

TEST(Csv, NamesLineAndColumn) {
  const CsvTable table = CsvTable::parse("# c\nid,x_mm\na,1\nb,word\n", "t.csv");
  EXPECT_THAT([&] { (void)table.number(1, "x_mm"); },
              ThrowsInputError("t.csv:4: column 'x_mm': 'word' is not a number"));
  EXPECT_THAT([&] { (void)table.number(0, "y_mm"); },
              ThrowsInputError("column 'y_mm' is missing; found id, x_mm"));
  EXPECT_THAT([] { (void)CsvTable::parse("a,b\n1\n", "t.csv"); },
              ThrowsInputError("t.csv:2: found 1 fields, wanted 2"));
  EXPECT_THAT([] { (void)CsvTable::parse("", "t.csv"); }, ThrowsInputError("no header line"));
}

TEST(PoseTable, RoundTrip) {
  const TemporaryFolder folder;
  const PoseRecord good{"p1", "ok", Pose{{1, -2, 3.25}, {0.1, -0.2, 0.3}}, Vector6d::Constant(1e-3), 3,
                        18,   0.021};
  const PoseRecord bad{"p, 2", "too_few_markers: found 1", std::nullopt, std::nullopt, 1, 0, std::nullopt};
  PoseRecord doubtful = good;
  doubtful.id = "p3";
  doubtful.status = "suspect: swapped with p4?";
  const fs::path path = folder.path() / "poses.csv";
  write_file_atomically(path, format_pose_table("# head\n", {good, bad, doubtful}, PoseColumns::measured));
  const auto back = read_pose_table(path);
  ASSERT_EQ(back.size(), 3U);
  EXPECT_EQ(back[2].status, doubtful.status);
  EXPECT_TRUE(is_suspect(back[2].status));
  EXPECT_LE((back[2].pose->vector() - good.pose->vector()).norm(), 1e-6);
  EXPECT_LE((*back[2].sigma - *good.sigma).norm(), 1e-6);
  EXPECT_EQ(back[0].id, "p1");
  EXPECT_LE((back[0].pose->vector() - good.pose->vector()).norm(), 1e-6);
  EXPECT_LE((*back[0].sigma - *good.sigma).norm(), 1e-6);
  EXPECT_EQ(back[0].images, 3);
  EXPECT_EQ(back[1].id, "p, 2");
  EXPECT_EQ(back[1].status, bad.status);
  EXPECT_FALSE(back[1].pose.has_value());
}

TEST(PoseTable, ASuspectPoseHasNumbers) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "poses.csv";
  write_file_atomically(path,
                        "pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\na,suspect: why,1,2,,0,0,0\n");
  EXPECT_THAT([&] { (void)read_pose_table(path); }, ThrowsInputError("poses.csv:2: column 'z_mm'"));
  EXPECT_FALSE(is_suspect("ok"));
  EXPECT_FALSE(is_suspect("suspected of nothing"));
}

TEST(PoseTable, RefusesDuplicatesAndWords) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "targets.csv";
  const std::string head = "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
  write_file_atomically(path, head + "a,1,2,3,0,0,0\na,1,2,3,0,0,0\n");
  EXPECT_THAT([&] { (void)read_pose_table(path); },
              ThrowsInputError("targets.csv:3: column 'pose': pose 'a' stands twice"));
  write_file_atomically(path, head + "a,1,zwei,3,0,0,0\n");
  EXPECT_THAT([&] { (void)read_pose_table(path); },
              ThrowsInputError(":2: column 'y_mm': 'zwei' is not a number"));
  write_file_atomically(path, head + "a,1,,3,0,0,0\n");
  EXPECT_THAT([&] { (void)read_pose_table(path); }, ThrowsInputError("is not a number"));
}

TEST(LegTable, RoundTrip) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "legs.csv";
  const LegRecord leg{"p1", "ok", Vector6d::LinSpaced(6, 401.123456, 480.5)};
  const LegRecord none{"p2", "leg 3 too long", std::nullopt};
  write_file_atomically(path, format_leg_table("# head\n", {leg, none}, true));
  const auto back = read_leg_table(path);
  ASSERT_EQ(back.size(), 2U);
  EXPECT_LE((*back[0].readings - *leg.readings).norm(), 1e-6);
  EXPECT_EQ(back[1].status, "leg 3 too long");
  EXPECT_FALSE(back[1].readings.has_value());
}

// Only in this test: a library's caller knows what it writes over.
class GuardedOutput : public ::testing::Test {
 protected:
  GuardedOutput() { allow_overwriting(Overwrite::own_results); }
  ~GuardedOutput() override { allow_overwriting(Overwrite::any_file); }

  void put(const fs::path& path, const std::string& text) const {
    fs::create_directories((folder_.path() / path).parent_path());
    std::ofstream(folder_.path() / path) << text;
  }
  void refuses(const fs::path& path, const std::string& text, const std::string& words) const {
    const std::string before = contents(folder_.path() / path);
    EXPECT_THAT([&] { write_file_atomically(folder_.path() / path, text); }, ThrowsInputError(words)) << path;
    EXPECT_EQ(contents(folder_.path() / path), before);
  }
  void writes(const fs::path& path, const std::string& text) const {
    EXPECT_NO_THROW(write_file_atomically(folder_.path() / path, text)) << path;
    EXPECT_EQ(contents(folder_.path() / path), text) << path;
  }

  TemporaryFolder folder_;
};

TEST_F(GuardedOutput, AnInputIsNotWrittenOverUnderAnyName) {
  put("notes.txt", "read\n");
  (void)read_file(folder_.path() / "notes.txt");
  fs::create_symlink("notes.txt", folder_.path() / "link.txt");
  fs::create_hard_link(folder_.path() / "notes.txt", folder_.path() / "hard.txt");
  fs::create_directory(folder_.path() / "down");
  for (const char* name : {"notes.txt", "link.txt", "hard.txt", "down/../notes.txt"})
    refuses(name, "new\n", "was read by this command; wanted another name, or --force");
  // What took an input's place is not the input, though it may have its inode.
  fs::rename(folder_.path() / "notes.txt", folder_.path() / "old.txt");
  put("notes.txt", "another\n");
  writes("notes.txt", "new\n");
  put("kept.json", "{}");
  (void)read_file(folder_.path() / "kept.json", ReadFor::own_result);
  writes("kept.json", "{1}");
}

TEST_F(GuardedOutput, APhotographOrAUsersTableIsNotWrittenOver) {
  const std::string legs = "# hexcal 1.2.3  legs  a.csv sha256:0\npose,q1\n";
  put("a.JPG", "whatever it is");
  put("photograph", "\xFF\xD8\xFF\xE0");
  put("user.csv", "pose,q1\na,1\n");
  put("user.yaml", "# made for hexcal\ncamera: a\n");
  put("poses.csv", "# hexcal 1.2.3  measure\npose,x_mm\n");
  put("legs.csv", "# hexcal 1.0.0  legs\npose,old\n");
  put("simulated.csv", "# hexcal 1.2.3  simulate\npose,q1\na,2\n");
  put("results/user.csv", "pose,q1\na,1\n");
  refuses("a.JPG", legs, "is a photograph");
  refuses("photograph", legs, "is a photograph");
  refuses("user.csv", legs, "is there already and hexcal did not write it");
  refuses("user.yaml", legs, "is there already and hexcal did not write it");
  refuses("poses.csv", legs, "another file than this one (hexcal measure wrote it)");
  writes("legs.csv", legs);       // written by the same command
  writes("simulated.csv", legs);  // the same kind of table
  writes("results/user.csv", legs);
  allow_overwriting(Overwrite::any_file);
  writes("user.csv", legs);
  EXPECT_THAT([] { write_file_atomically("/dev/null", ""); }, ThrowsInputError("is a device or a pipe"));
}

TEST_F(GuardedOutput, TwoResultsOfOneName) {
  const fs::path path = folder_.path() / "a.txt";
  EXPECT_THAT(
      [&] {
        write_files_atomically({{path, "1"}, {folder_.path() / "." / "a.txt", "2"}});
      },
      ThrowsInputError("a.txt: two results would go to this file"));
  EXPECT_FALSE(fs::exists(path));
}

}  // namespace
}  // namespace hexcal
