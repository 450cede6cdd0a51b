#include <gtest/gtest.h>
#include "audio/performance.h"
using namespace audio;
TEST(Smoke, a){
  for (auto ins : {"drum","bell","string","cymbal"}) {
  try {
  Performance p(MUSICWORLD_SOURCE_DIR "/assets/orchestra/musicworld.orc", {{ins,ins,{},0.5,0,""}});
  p.schedule({1,0,1000,8,0.3,0,38,64});
  auto x=p.finish(96000,480000);
  size_t first=0; float peak=0; for(size_t i=0;i<x.size();i++){ if(x[i]!=0&&!first)first=i/2; peak=std::max(peak,std::abs(x[i]));}
  printf("%s n %zu first %zu peak %f busy %f %s\n",ins,x.size()/2,first,peak,p.busy_s(),p.version().c_str());
  write_wav(std::string("/tmp/ha/")+ins+".wav",x);
  } catch(std::exception&e){puts(e.what());}}
}
