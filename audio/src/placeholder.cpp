namespace audio {}
