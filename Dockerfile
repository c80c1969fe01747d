# doppel in a container of Debian 12, in two stages: the packages are built in the first, the second has no compiler.
#
#   docker build -t doppel .
#   docker run --rm -it -p 8700:8700 doppel up omarm_one --host 0.0.0.0
#   docker run --rm -it -p 8700:8700 -v "$PWD":/work doppel up my_arm.urdf.xacro --host 0.0.0.0
FROM debian:bookworm-slim AS build
WORKDIR /doppel
COPY . .
RUN apt-get update -qq && tools/build packages

FROM debian:bookworm-slim
COPY --from=build /doppel/build/packages/doppel_*.deb /doppel/build/packages/libdoppel0_*.deb \
  /doppel/build/packages/doppel-data_*.deb /packages/
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends /packages/*.deb && \
  rm -rf /packages /var/lib/apt/lists/*
WORKDIR /work
EXPOSE 8700
ENTRYPOINT ["doppel"]
CMD ["up", "omarm_one", "--host", "0.0.0.0"]
