#include "client/cli/reproduce/page.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/reproduce/markup.h"
#include "client/cli/reproduce/style.h"
#include "core/base/colour.h"

namespace lpdeform::reproduce {
namespace {

struct Count {
  int holding = 0, all = 0;
};

Count count_claims(const std::vector<Figure>& figures) {
  Count count;
  for (const Figure& figure : figures) {
    for (const Claim& claim : figure.claims) {
      ++count.all;
      if (claim.holds) ++count.holding;
    }
  }
  return count;
}

const char* verdict_text(const Claim& claim) {
  return claim.holds ? "holds here" : "does not hold here";
}

std::string claim_html(const Claim& claim) {
  return absl::StrCat("<div class=\"claim", claim.holds ? "" : " fails", "\">\n<p><b>The paper:</b> ",
                      escaped(claim.text), "</p>\n<p><b>Here:</b> ", escaped(claim.measured),
                      " <span class=\"verdict\">", verdict_text(claim), "</span></p>\n</div>\n");
}

/// The legend of the pictures' colours; the pictures themselves have none.
std::string legend_html() {
  std::vector<std::string> stops;
  for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const Rgb colour = blue_to_red(t);
    stops.push_back(absl::StrCat("rgb(", colour[0], " ", colour[1], " ", colour[2], ")"));
  }
  return absl::StrCat(
      "<p class=\"legend\">Handles are blue at rest. Results: <span class=\"bar\" style=\"background: "
      "linear-gradient(to right, ",
      absl::StrJoin(stops, ", "), ")\"></span> cell energy from 0 to each picture's own largest.</p>\n");
}

std::string pictures_html(const Figure& figure) {
  if (figure.pictures.empty()) return "";
  const bool is_tall = figure.pictures.front().height > figure.pictures.front().width;
  std::string html =
      absl::StrCat("<div class=\"pictures of_", figure.pictures.size(), is_tall ? " tall" : "", "\">\n");
  for (const Picture& picture : figure.pictures) {
    absl::StrAppend(&html, "<figure><img src=\"", escaped(picture.file), "\" width=\"", picture.width,
                    "\" height=\"", picture.height, "\" alt=\"",
                    escaped(absl::StrCat(figure.shape, " ", picture.caption)), "\" /><figcaption>",
                    escaped(picture.caption), "</figcaption></figure>\n");
  }
  return absl::StrCat(html, "</div>\n", legend_html());
}

std::string figure_html(const Figure& figure) {
  std::string html = absl::StrCat("<section id=\"", escaped(figure.id), "\">\n<h2>", escaped(figure.title),
                                  "</h2>\n<p class=\"shape\">", escaped(figure.shape), "</p>\n");
  for (const Claim& claim : figure.claims) html += claim_html(claim);
  absl::StrAppend(&html, figure.body, pictures_html(figure));
  if (!figure.note.empty()) absl::StrAppend(&html, "<p class=\"note\">", escaped(figure.note), "</p>\n");
  return html + "</section>\n";
}

std::string overview_html(const std::vector<Figure>& figures) {
  std::string html =
      "<div class=\"wide\"><table>\n<thead><tr><th scope=\"col\">Figure</th>"
      "<th scope=\"col\">Claims that hold here</th></tr></thead>\n<tbody>\n";
  for (const Figure& figure : figures) {
    const Count count = count_claims({figure});
    absl::StrAppend(&html, "<tr><th scope=\"row\"><a href=\"#", escaped(figure.id), "\">",
                    escaped(figure.title), "</a></th><td><span class=\"verdict",
                    count.holding == count.all ? "" : " fails", "\">", count.holding, " of ", count.all,
                    "</span></td></tr>\n");
  }
  return html + "</tbody></table></div>\n";
}

std::string header_html(const std::vector<Figure>& figures, const Settings& settings) {
  const Count count = count_claims(figures);
  return absl::StrCat(
      "<header>\n<h1>L<sub>p</sub> shape deformation, reproduced</h1>\n<p>Every figure and the table of Gao, "
      "Zhang and Lai, <cite>L<sub>p</sub> shape deformation</cite>, Science China Information Sciences 55, "
      "2012 (doi 10.1007/s11432-012-4574-y), reproduced by solves on generated shapes",
      settings.others.empty() ? "" : " and on meshes that were added",
      ". Next to each claim of the paper is the number that decides it, computed in the same run.</p>\n<p>",
      count.holding, " of ", count.all, " claims hold here",
      settings.size == 1
          ? ""
          : absl::StrCat(", with shapes of ", number_text(settings.size), " times the usual size"),
      ".</p>\n</header>\n");
}

nlohmann::ordered_json claim_json(const Claim& claim) {
  nlohmann::ordered_json numbers = nlohmann::ordered_json::object();
  for (const auto& [name, value] : claim.numbers) numbers[name] = value;
  return {{"text", claim.text}, {"measured", claim.measured}, {"holds", claim.holds}, {"numbers", numbers}};
}

}  // namespace

std::vector<Figure> all_figures(const Measurements& measured,
                                const std::function<bool(const std::string& title)>& begins) {
  using Maker = Figure (*)(const Measurements&);
  constexpr std::pair<const char*, Maker> kMakers[] = {
      {"Table 1", table_1},   {"Figure 1", figure_1}, {"Figure 2", figure_2},       {"Figure 3", figure_3},
      {"Figure 4", figure_4}, {"Figure 5", figure_5}, {"Figure 6", figure_6},       {"Figure 7", figure_7},
      {"Figure 8", figure_8}, {"Figure 9", figure_9}, {"section 3.2", section_3_2}, {"section 5", section_5},
      {"appendix", appendix}};
  std::vector<Figure> figures;
  for (const auto& [title, make] : kMakers) {
    if (!begins(title)) return figures;
    figures.push_back(make(measured));
  }
  for (const Experiment& other : measured.others) {
    if (!begins(other.pose.name)) return figures;
    figures.push_back(other_mesh(other));
  }
  return figures;
}

std::string page_html(const std::vector<Figure>& figures, const Settings& settings) {
  std::string html = absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n"
      "<meta charset=\"utf-8\" />\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n"
      "<title>L_p shape deformation, reproduced</title>\n<style>",
      kStyle, "</style>\n</head>\n<body>\n", header_html(figures, settings), overview_html(figures));
  for (const Figure& figure : figures) html += figure_html(figure);
  absl::StrAppend(&html, "<footer><p>Made by <code>", kMadeBy,
                  "</code>; the verdicts for programs are in <a "
                  "href=\"reproduce.json\">reproduce.json</a>.</p></footer>\n"
                  "</body>\n"
                  "</html>\n");
  return html;
}

std::string verdicts_json(const std::vector<Figure>& figures, const Settings& settings) {
  const Count count = count_claims(figures);
  nlohmann::ordered_json root{{"made_by", kMadeBy},
                              {"size", settings.size},
                              {"threads", settings.threads},
                              {"claims", count.all},
                              {"claims_that_hold", count.holding},
                              {"figures", nlohmann::ordered_json::array()}};
  for (const Figure& figure : figures) {
    nlohmann::ordered_json claims = nlohmann::ordered_json::array(),
                           pictures = nlohmann::ordered_json::array();
    for (const Claim& claim : figure.claims) claims.push_back(claim_json(claim));
    for (const Picture& picture : figure.pictures) pictures.push_back(picture.file);
    root["figures"].push_back({{"id", figure.id},
                               {"title", figure.title},
                               {"claims", std::move(claims)},
                               {"pictures", std::move(pictures)}});
  }
  return root.dump(2) + "\n";
}

std::set<std::string> pictures_named(const std::string& verdicts) {
  const auto root = nlohmann::json::parse(verdicts, nullptr, false);
  std::set<std::string> names;
  if (!root.is_object() || !root.contains("figures") || !root["figures"].is_array()) return names;
  for (const auto& figure : root["figures"]) {
    if (!figure.is_object() || !figure.contains("pictures") || !figure["pictures"].is_array()) continue;
    for (const auto& picture : figure["pictures"]) {
      if (!picture.is_string()) continue;
      const auto name = picture.get<std::string>();
      if (name.ends_with(".png") && name.find('/') == std::string::npos) names.insert(name);
    }
  }
  return names;
}

}  // namespace lpdeform::reproduce
