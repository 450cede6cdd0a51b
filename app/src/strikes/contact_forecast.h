#pragma once
#include <sim/simulation.h>
#include <tracking/contact_times.h>

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace app {

/// When a stick will strike by the network of contacts of a model.
///
/// Each surface is looked at as the plane that touches it where the path of the sound's predictor meets it, or, if it
/// does not, is nearest to it. The network says when the tip meets it (tracking::contact_times); the surface that is
/// met with the greatest probability counts. The time of the strike is the median t; its probability P that of a
/// contact within 30 ms of t, in which a note and a contact belong together. Below P = 5 % nothing is expected.
///
/// The answer is a path that meets the surface at t, to be swept as any other: along the surface that of the
/// predictor, towards it at a constant acceleration from the tip's velocity, so that it falls all the way.
///
/// One thread. A pure function of its arguments.
class ContactForecast {
public:
    /// Distance of a tip from a surface, by its number, and the normal there.
    using Nearest = std::function<sim::SurfacePoint(std::size_t, const Eigen::Vector3d&)>;
    struct Surfaces {
        std::size_t count = 0;
        Nearest nearest;
    };
    /// What the tip is expected to do.
    struct Path {
        sim::TipPath path;
        std::size_t surface = 0;
        double in_s = 0, probability = 0;
    };

    struct Forecast {
        /// By surface, of the time to it; none of one out of reach (tracking::contact_times) or that the tip is
        /// beside. Empty where the tip is in a surface.
        std::vector<std::optional<tracking::ContactTimes>> times;
        std::optional<Path> strike;  ///< none where nothing is likely to be struck
    };

    /// `model` has a network of contacts.
    explicit ContactForecast(std::shared_ptr<const tracking::PathModel> model) : model_(std::move(model)) {}
    [[nodiscard]] const tracking::PathModel& model() const { return *model_; }

    /// After a sample: `predicted` is the path of the sound's predictor; strikes are looked for `reach_s` ahead.
    [[nodiscard]] Forecast after(const tracking::TipView& tip, const sim::TipPath& predicted,
                                 const Surfaces& surfaces, double reach_s) const;

private:
    std::shared_ptr<const tracking::PathModel> model_;
};

}  // namespace app
