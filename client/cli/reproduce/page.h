#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "client/cli/reproduce/figure.h"

namespace lpdeform::reproduce {

/// All figures of the paper and those of other meshes, in the page's order, with their pictures. Calls
/// `begins` with the title of each figure before it is made; stops if that returns false.
std::vector<Figure> all_figures(const Measurements& measured,
                                const std::function<bool(const std::string& title)>& begins);

/// The page: HTML that is also well-formed XML, in UTF-8, with inline style and plots and without scripts.
/// Pictures are separate files next to it.
std::string page_html(const std::vector<Figure>& figures, const Settings& settings);

/// The verdicts for programs: {made_by, size, threads, claims, claims_that_hold, figures: [{id, title, claims:
/// [{text, measured, holds, numbers}], pictures}]}.
std::string verdicts_json(const std::vector<Figure>& figures, const Settings& settings);

/// The pictures that such verdicts name: plain file names of PNG files only. Empty if the text is not of this
/// form.
std::set<std::string> pictures_named(const std::string& verdicts);

/// The value of `made_by`, which marks a folder as made by this command.
inline constexpr const char* kMadeBy = "lpdeform reproduce";

}  // namespace lpdeform::reproduce
