/* A plain UDP forwarder, to measure the relay against: poll, recvfrom and sendto for each packet, and nothing else.
 *
 * It asks for the scheduling that the relay asks for: on a busy host, who is woken late finds several packets at once and
 * takes less for each.
 *
 * One socket for all clients and, for each, one toward the target on the same host, whose port is the argument. Prints its
 * own port. Ends when its standard input does. */
#include <arpa/inet.h>
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CLIENTS = 64, BUFFER = 4 << 20 };

static struct sockaddr_in here(int port) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(port)};
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

static int port_of_its_own(void) {
    struct sockaddr_in any = here(0);
    int fd = socket(AF_INET, SOCK_DGRAM, 0), bytes = BUFFER;
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    if (fd < 0 || bind(fd, (struct sockaddr *)&any, sizeof any) < 0)
        exit(1);
    return fd;
}

int main(int count, char **arguments) {
    static char packet[65536];
    struct sockaddr_in target = here(count > 1 ? atoi(arguments[1]) : 0), clients[CLIENTS], from;
    socklen_t length = sizeof from;
    /* standard input, the clients, the target's answers to each of them */
    struct pollfd fds[2 + CLIENTS] = {{.events = POLLIN}, {.fd = port_of_its_own(), .events = POLLIN}};
    int known = 0;
    struct sched_param priority = {.sched_priority = 40};
    sched_setscheduler(0, SCHED_FIFO, &priority);
    getsockname(fds[1].fd, (struct sockaddr *)&from, &length);
    printf("%d\n", ntohs(from.sin_port));
    fflush(stdout);
    for (;;) {
        poll(fds, 2 + known, -1);
        if (fds[0].revents)
            return 0;
        if (fds[1].revents) {
            length = sizeof from;
            ssize_t bytes = recvfrom(fds[1].fd, packet, sizeof packet, 0, (struct sockaddr *)&from, &length);
            int client = 0;
            while (client < known && (clients[client].sin_port != from.sin_port ||
                                      clients[client].sin_addr.s_addr != from.sin_addr.s_addr))
                client++;
            if (client == known && known < CLIENTS) {
                clients[known] = from;
                fds[2 + known++] = (struct pollfd){.fd = port_of_its_own(), .events = POLLIN};
            }
            if (bytes >= 0 && client < known)
                sendto(fds[2 + client].fd, packet, bytes, 0, (struct sockaddr *)&target, sizeof target);
        }
        for (int client = 0; client < known; client++) {
            if (!fds[2 + client].revents)
                continue;
            ssize_t bytes = recvfrom(fds[2 + client].fd, packet, sizeof packet, 0, NULL, NULL);
            if (bytes >= 0)
                sendto(fds[1].fd, packet, bytes, 0, (struct sockaddr *)&clients[client], sizeof clients[client]);
        }
    }
}
