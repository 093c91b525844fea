# SPDX-License-Identifier: MIT
# Image with the dependencies and the programs of the demo. Build: docker build --tag bevel .
# Run the demo: docker run --rm --privileged bevel tools/demo   (it creates a network namespace)
FROM debian:12
ENV DEBIAN_FRONTEND=noninteractive
WORKDIR /opt/bevel
COPY . .
# One layer: the package lists and the compiler cache are not part of the image.
RUN tools/setup && rm -rf /var/lib/apt/lists/* /root/.cache /root/.ccache
CMD ["bash"]
