// tests/server/jobs/elements.h - whether a page that a job wrote is well-formed and stands alone.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace spinaltap::test {

/// Every element that is opened is closed, in order; gives the names that there are.
inline std::multiset<std::string> elementsOf(const std::string& page) {
  std::multiset<std::string> names;
  std::vector<std::string> open;
  const std::regex tag(R"(<(/?)([A-Za-z0-9]+)((?:\s+[A-Za-z0-9:-]+="[^"<]*")*)\s*(/?)>)");
  std::string rest = page.substr(page.find('\n'));  // after the doctype
  std::size_t tags = 0;
  for (std::sregex_iterator at(rest.begin(), rest.end(), tag), end; at != end; ++at, ++tags) {
    const std::string name = (*at)[2];
    if ((*at)[1] == "/") {
      EXPECT_FALSE(open.empty()) << name;
      if (open.empty()) return names;
      EXPECT_EQ(open.back(), name);
      open.pop_back();
      continue;
    }
    names.insert(name);
    if ((*at)[4] != "/") open.push_back(name);
  }
  EXPECT_TRUE(open.empty()) << open.back();
  EXPECT_EQ(tags, static_cast<std::size_t>(std::count(rest.begin(), rest.end(), '<'))) << "each < begins a tag";
  const std::regex ampersand("&(?!(amp|lt|gt|quot);)");
  EXPECT_FALSE(std::regex_search(rest, ampersand)) << "each & begins an entity";
  return names;
}

/// @param names of the page's elements.
inline void expectNeedsNothingElse(const std::string& page, const std::multiset<std::string>& names) {
  EXPECT_EQ(names.count("script") + names.count("link") + names.count("img"), 0U);
  EXPECT_EQ(page.find("url("), std::string::npos);
  EXPECT_EQ(std::regex_replace(page, std::regex("xmlns=\"[^\"]*\""), "").find("http"), std::string::npos);
}

}  // namespace spinaltap::test
