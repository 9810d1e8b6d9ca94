#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "client/cli/reproduce/figure.h"

namespace lpdeform::reproduce {

/// All figures of the paper and of others' meshes, in the page's order. Draws their pictures. `begins` is called
/// with each one's title before; where it returns false no more are made.
std::vector<Figure> all_figures(const Measurements& measured,
                                const std::function<bool(const std::string& title)>& begins);

/// The page: HTML that is also well-formed XML, in UTF-8, with its style and plots inside and without scripts;
/// pictures are found by their file names beside it.
std::string page_html(const std::vector<Figure>& figures, const Settings& settings);

/// The verdicts for programs: {made_by, size, threads, claims, claims_that_hold, figures: [{id, title, claims:
/// [{text, measured, holds, numbers}], pictures}]}.
std::string verdicts_json(const std::vector<Figure>& figures, const Settings& settings);

/// The pictures that such verdicts name, plain file names of PNG pictures alone; none where the text is something else.
std::set<std::string> pictures_named(const std::string& verdicts);

/// What `made_by` says, by which a folder is known to be ours.
inline constexpr const char* kMadeBy = "lpdeform reproduce";

}  // namespace lpdeform::reproduce
