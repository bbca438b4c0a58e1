#include "tools/report/canvas.h"

#include <array>
#include <cassert>

namespace hexcal {
namespace {

struct InkColour {
  std::string_view name;
  std::uint32_t light;
};

// Okabe-Ito, the yellow replaced by grey: yellow is not readable on white.
constexpr std::array<InkColour, 15> kInks{{{"text", 0x1b1f24},
                                           {"muted", 0x57606a},
                                           {"grid", 0xd8dee4},
                                           {"surface", 0xffffff},
                                           {"good", 0x00785a},
                                           {"warning", 0x9a5b00},
                                           {"bad", 0xb3261e},
                                           {"s0", 0x0072b2},
                                           {"s1", 0xd55e00},
                                           {"s2", 0x009e73},
                                           {"s3", 0xcc79a7},
                                           {"s4", 0xe69f00},
                                           {"s5", 0x56b4e9},
                                           {"s6", 0x6e4f9e},
                                           {"s7", 0x7f7f7f}}};

}  // namespace

Ink series_ink(int index) {
  assert(index >= 0);
  return static_cast<Ink>(static_cast<int>(Ink::series0) + index % 8);
}

std::uint32_t light_rgb(Ink ink) {
  assert(ink != Ink::exact);
  return kInks.at(static_cast<std::size_t>(ink)).light;
}

std::string_view ink_name(Ink ink) {
  assert(ink != Ink::exact);
  return kInks.at(static_cast<std::size_t>(ink)).name;
}

void Canvas::line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Stroke& stroke) {
  const std::array points{a, b};
  polyline(points, stroke);
}

double text_width(std::string_view words, double size) {
  double em = 0;
  for (const char c : words) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // the rest of a UTF-8 character
    if (c == 'i' || c == 'l' || c == 'j' || c == '.' || c == ',' || c == '\'' || c == '|' || c == ' ' ||
        c == 'I') {
      em += 0.29;
    } else if (c == 'm' || c == 'w' || c == 'M' || c == 'W') {
      em += 0.86;
    } else if (c >= 'A' && c <= 'Z') {
      em += 0.68;
    } else {
      em += 0.56;
    }
  }
  return em * size;
}

}  // namespace hexcal
