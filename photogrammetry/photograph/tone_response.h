#pragma once

#include "photogrammetry/photograph/photograph.h"

namespace hexcal {

/// How a camera encodes light: the nominal curve (sRGB, IEC 61966-2-1, or linear) and what is left over of a
/// real camera's curve, with E the nominal value:
///   encoded = E + first E (1 - E) + second E (1 - E) (1 - 2 E)
/// `first` is a gamma that differs, `second` an S shape. Light and encoded values are shares of full scale.
class ToneResponse {
 public:
  struct Encoded {
    double value;
    double by_light;
    double by_first, by_second;
  };

  explicit ToneResponse(ToneCurve nominal, double first = 0, double second = 0)
      : nominal_(nominal), first_(first), second_(second) {}

  [[nodiscard]] ToneCurve nominal() const { return nominal_; }
  [[nodiscard]] double first() const { return first_; }
  [[nodiscard]] double second() const { return second_; }

  /// Light may lie outside 0 to 1; the curve goes on smoothly. By table, to 1e-6.
  [[nodiscard]] Encoded encode(double light) const;
  /// Inverse of encode.
  [[nodiscard]] double decode(double encoded) const;

 private:
  ToneCurve nominal_;
  double first_;
  double second_;
};

}  // namespace hexcal
