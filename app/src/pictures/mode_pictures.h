#pragma once
#include <render/scene.h>
#include <sim/modes.h>

#include <filesystem>

namespace app {

/// Draws the lowest modes as figure 2-3 of the thesis does: the body with a chequered skin, deformed by each
/// mode in turn, its largest displacement 0.2 of the body's mean extent. At most `most` of them.
class ModePictures {
public:
    ModePictures(const sim::ModesRequest& request, const sim::ModalBasis& basis, int most);

    /// Writes FOLDER/000001.png for the first mode and so on, and all of them side by side, in rows of
    /// six, into `sheet`. Throws std::runtime_error.
    void write(const std::filesystem::path& folder, const std::filesystem::path& sheet) const;

private:
    [[nodiscard]] render::SceneDescription description() const;
    [[nodiscard]] render::FrameState frame(int mode) const;

    render::Solid solid_;
    double scale_;               ///< drawn over real lengths: what is drawn fits the picture
    double rise_;                ///< half the drawn height, with room for the deformation
    Eigen::VectorXf amplitude_;  ///< of each mode [m kg^1/2]
};

}  // namespace app
