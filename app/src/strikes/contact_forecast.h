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

/// Predicts a stick's next strike by the network of contacts of a model.
///
/// Each surface is replaced by its tangent plane where the path of the sound's predictor meets it, or, if it
/// does not, is nearest to it. For each plane the network gives a distribution of the time to contact
/// (tracking::contact_times); the surface with the greatest probability of a contact is the predicted one.
/// The time t of the strike is the median of its distribution. Its probability P is that of a contact within
/// 30 ms of t: within that time a note and a contact belong together. Below P = 5 % no strike is predicted.
///
/// The answer is a path that meets the surface at t and can be swept as any other. Along the surface it is
/// the predictor's path; towards the surface it has a constant acceleration from the tip's velocity, so that
/// it falls all the way.
///
/// One thread. A pure function of its arguments.
class ContactForecast {
public:
    /// Distance of a tip from the surface of that number, and the normal there.
    using Nearest = std::function<sim::SurfacePoint(std::size_t, const Eigen::Vector3d&)>;
    struct Surfaces {
        std::size_t count = 0;
        Nearest nearest;
    };
    /// The path of the predicted strike.
    struct Path {
        sim::TipPath path;
        std::size_t surface = 0;
        double in_s = 0, probability = 0;
    };

    struct Forecast {
        /// By surface, the distribution of the time to contact; none where it is out of reach
        /// (tracking::contact_times) or the tip is beside it. Empty where the tip is in a surface.
        std::vector<std::optional<tracking::ContactTimes>> times;
        std::optional<Path> strike;  ///< none where P is below 5 %
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
