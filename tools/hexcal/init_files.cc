#include "tools/hexcal/init_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "tools/io/atomic_file.h"
#include "tools/io/csv_table.h"
#include "tools/io/sheet_file.h"
#include "tools/io/template_pdf.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

constexpr double kStickerGapMm = 8;
constexpr double kSheetMarkerMm = 20, kSheetGapMm = 7;
constexpr int kSheetFirstId = 200;  // where the stickers leave room for it
constexpr PaperSize kSheetPaper{420, 297};

}  // namespace

std::string images_table_text(const std::string& head,
                              const std::vector<std::pair<std::string, std::string>>& table) {
  std::string text = head + "file,pose\n";
  for (const auto& [file, pose] : table) text += fmt::format("{},{}\n", csv_field(file), csv_field(pose));
  return text;
}

std::string targets_template(const std::string& head, const std::vector<std::string>& poses,
                             const std::string& home) {
  std::string text =
      head +
      "# The commanded poses relative to home: mm and deg. Fill in, then write ok as the status.\n"
      "pose,status,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";
  for (const std::string& pose : poses)
    text += csv_field(pose) + (pose == home ? ",ok,0,0,0,0,0,0\n" : ",not filled in,,,,,,\n");
  return text;
}

std::vector<std::pair<std::string, std::string>> prints_for_new_campaign(const CampaignDraft& draft,
                                                                         double marker_mm) {
  TemplatePdfOptions options;
  Sheet stickers;
  stickers.kind = SheetKind::markers;
  stickers.family = draft.family;
  stickers.marker_mm = marker_mm;
  stickers.spacing_mm = kStickerGapMm;
  for (const MarkerSizes* body : {&draft.fixed, &draft.moving})
    for (const auto& [id, size] : *body) stickers.ids.push_back(id);
  const auto count = static_cast<int>(stickers.ids.size());
  const int last_id = *std::max_element(stickers.ids.begin(), stickers.ids.end());
  stickers.columns = std::clamp(largest_grid(stickers, options).first, 1, count);
  stickers.rows = (count + stickers.columns - 1) / stickers.columns;
  const std::vector<Sheet> pages = sticker_pages(stickers, options);
  const std::string head = provenance_line(kVersion, "template", {});
  Sheet sheet;
  sheet.kind = SheetKind::aprilgrid;
  sheet.family = "tag36h11";
  sheet.marker_mm = kSheetMarkerMm;
  sheet.spacing_mm = kSheetGapMm;
  sheet.first_id = std::max(kSheetFirstId, last_id + 1);
  TemplatePdfOptions sheet_options;
  sheet_options.paper_mm = kSheetPaper;
  std::tie(sheet.columns, sheet.rows) = largest_grid(sheet, sheet_options);
  sheet.validate();
  return {{"markers.pdf", template_pdf(pages, options)},
          {"markers.yaml", format_sheet_file(head, pages)},
          {"sheet.pdf", template_pdf({sheet}, sheet_options)},
          {"sheet.yaml", format_sheet_file(head, {sheet})}};
}

}  // namespace hexcal
