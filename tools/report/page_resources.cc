#include "tools/report/page_resources.h"

namespace hexcal {

// Defined in the source file that embed_resources.cmake makes.
extern const std::string_view kEmbedded_style;
extern const std::string_view kEmbedded_script;
extern const std::string_view kEmbedded_scene_script;
extern const std::string_view kEmbedded_three;
extern const std::string_view kEmbedded_three_licence;

std::string_view resource(Resource which) {
  switch (which) {
    case Resource::style:
      return kEmbedded_style;
    case Resource::script:
      return kEmbedded_script;
    case Resource::scene_script:
      return kEmbedded_scene_script;
    case Resource::three:
      return kEmbedded_three;
    case Resource::three_licence:
      return kEmbedded_three_licence;
  }
  return {};
}

}  // namespace hexcal
