#pragma once

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace hexcal {

/// What is wrong with an XML text; empty if its elements nest, its attributes are quoted and its `&` are
/// entities. Enough to find what an escaping mistake breaks; no validation.
inline std::string xml_fault(const std::string& xml) {
  std::vector<std::string> open;
  std::size_t at = 0;
  while (at < xml.size()) {
    if (xml[at] == '&') {
      const std::size_t end = xml.find_first_not_of("abcdefghijklmnopqrstuvwxyz#0123456789", at + 1);
      if (end == std::string::npos || xml[end] != ';') return "bare & at " + std::to_string(at);
    }
    if (xml[at] != '<') {
      ++at;
      continue;
    }
    std::size_t end = at + 1;
    char quote = 0;
    for (; end < xml.size() && (quote != 0 || xml[end] != '>'); ++end) {
      if (quote == 0 && xml[end] == '<') return "< within a tag at " + std::to_string(end);
      if (xml[end] == '"' || xml[end] == '\'')
        quote = quote == 0 ? xml[end] : quote == xml[end] ? '\0' : quote;
    }
    if (end == xml.size()) return "a tag without end at " + std::to_string(at);
    const std::string tag = xml.substr(at + 1, end - at - 1);
    const std::string name = tag.substr(0, tag.find_first_of(" /\n", 1));
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return "unexpected <" + tag + '>';
      open.pop_back();
    } else if (tag[0] != '?' && tag[0] != '!' && tag.back() != '/') {
      open.push_back(name);
    }
    at = end + 1;
  }
  return open.empty() ? "" : "<" + open.back() + "> is not closed";
}

MATCHER(IsWellFormedXml, "") {
  const std::string fault = xml_fault(arg);
  *result_listener << fault;
  return fault.empty();
}

}  // namespace hexcal
