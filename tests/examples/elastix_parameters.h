/* elastix_parameters.h - elastix's B-spline registration of two images of one kind, as a parameter file without
 * FinalGridSpacingInPhysicalUnits; of other metrics by ELASTIX_PARAMETERS. */
#ifndef TEST_ELASTIX_PARAMETERS_H
#define TEST_ELASTIX_PARAMETERS_H

#define ELASTIX_PARAMETERS(metric)                                                                                            \
    "(FixedInternalImagePixelType \"float\")\n(MovingInternalImagePixelType \"float\")\n(FixedImageDimension 3)\n"            \
    "(MovingImageDimension 3)\n(UseDirectionCosines \"true\")\n(Registration \"MultiResolutionRegistration\")\n"              \
    "(Interpolator \"LinearInterpolator\")\n(ResampleInterpolator \"FinalBSplineInterpolator\")\n"                            \
    "(Resampler \"DefaultResampler\")\n"                                                                                      \
    "(FixedImagePyramid \"FixedSmoothingImagePyramid\")\n(MovingImagePyramid \"MovingSmoothingImagePyramid\")\n"              \
    "(Optimizer \"AdaptiveStochasticGradientDescent\")\n(Transform \"BSplineTransform\")\n(Metric \"" metric "\")\n"          \
    "(HowToCombineTransforms \"Compose\")\n(AutomaticTransformInitialization \"false\")\n"                                    \
    "(NumberOfResolutions 3)\n(MaximumNumberOfIterations 300)\n(NumberOfSpatialSamples 4000)\n"                               \
    "(NewSamplesEveryIteration \"true\")\n"                                                                                   \
    "(ImageSampler \"RandomCoordinate\")\n(BSplineInterpolationOrder 1)\n(FinalBSplineInterpolationOrder 3)\n"                \
    "(RandomSeed 12345)\n(WriteResultImage \"false\")\n(ResultImageFormat \"nii\")\n(DefaultPixelValue 0)\n"

static const char elastix_parameters[] = ELASTIX_PARAMETERS("AdvancedMeanSquares");

#endif
