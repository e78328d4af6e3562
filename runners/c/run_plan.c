/* Renders a plan of `restir export-plan --to spirv` by Vulkan 1.2, and writes the image as a PFM file.
 *
 *     cc -O2 -o run_plan run_plan.c -lvulkan
 *     ./run_plan FOLDER IMAGE.pfm
 *
 * It shows what a program has to do, and is not tuned: all buffers lie in memory that the host sees.
 */
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>
#define JSMN_STATIC
#define JSMN_STRICT
#include "jsmn.h"

static _Noreturn void fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fputs("error: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    exit(2);
}

static void check(VkResult result, const char *what) { if (result != VK_SUCCESS) fail("%s: Vulkan says %d", what, result); }

static void *allocate(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    if (!memory) fail("out of memory");
    return memory;
}

/* Files */
static const char *folder;
static char *read_file(const char *name, size_t *size) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    if (!file) fail("cannot read %s", path);
    fseek(file, 0, SEEK_END);
    long length = ftell(file);
    if (length < 0) fail("%s is no file", path);
    rewind(file);
    *size = (size_t)length;
    char *bytes = allocate(*size + 1, 1);
    if (fread(bytes, 1, *size, file) != *size) fail("cannot read %s", path);
    fclose(file);
    return bytes;
}

/* JSON: values are indices of tokens. The reader is strict, so that each key has a value. */
static char *json;
static jsmntok_t *tokens;
static int after(int value) {
    int next = value + 1;
    /* a key has its value as its only child */
    for (int i = 0; i < tokens[value].size; i++) next = after(next);
    return next;
}

static int is(int value, const char *text) {
    size_t length = (size_t)(tokens[value].end - tokens[value].start);
    return strlen(text) == length && !strncmp(json + tokens[value].start, text, length);
}

static int find(int object, const char *key) {
    for (int i = 0, at = object + 1; i < tokens[object].size; i++, at = after(at))
        if (is(at, key)) return at + 1;
    return 0;
}

static int member(int object, const char *key) {
    int value = find(object, key);
    if (!value) fail("plan.json lacks %s; export the plan again", key);
    return value;
}

static uint64_t number(int value) {
    char first = json[tokens[value].start];
    if (tokens[value].type != JSMN_PRIMITIVE || first < '0' || first > '9') fail("plan.json has something else where a number belongs");
    return strtoull(json + tokens[value].start, NULL, 10);
}

static uint64_t below(int value, uint64_t limit) {
    if (number(value) >= limit) fail("plan.json names what is not there; export the plan again");
    return number(value);
}

static char *string(int value) {
    json[tokens[value].end] = 0;
    return json + tokens[value].start;
}

/* The plan */
typedef struct { VkBuffer buffer; VkDeviceMemory memory; void *mapped; uint64_t bytes; } Buffer;

typedef struct {
    uint32_t bindings;
    int names; /* the list of bindings in the document */
    VkDescriptorSetLayout set_layout;
    VkPipelineLayout layout;
    VkPipeline pipeline;
} Kernel;

typedef struct { uint32_t count, *values; } List;

typedef struct {
    Kernel *kernel;
    List frames;   /* first and last of each range */
    List *buffers; /* what is bound to each binding but the first, time by time */
    List groups, params;
    int changes;
    uint32_t times; /* how often it has run */
    uint64_t block; /* where its parameters are in the buffer of all parameters */
} Pass;

static VkPhysicalDevice physical;
static VkDevice device;
static VkQueue queue;
static uint32_t family;

static void open_device(void) {
    VkApplicationInfo application = {VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_2};
    VkInstanceCreateInfo info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application};
    VkInstance instance;
    check(vkCreateInstance(&info, NULL, &instance), "no Vulkan 1.2");
    VkPhysicalDevice all[16];
    uint32_t count = 16, family_count = 16;
    vkEnumeratePhysicalDevices(instance, &count, all);
    if (!count) fail("there is no Vulkan device; install a driver, such as Mesa's");
    VkPhysicalDeviceProperties properties;
    physical = all[0];
    for (uint32_t i = count; i-- > 0;) { /* hardware before software */
        vkGetPhysicalDeviceProperties(all[i], &properties);
        if (properties.deviceType != VK_PHYSICAL_DEVICE_TYPE_CPU) physical = all[i];
    }
    VkPhysicalDeviceFloatControlsProperties floats = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FLOAT_CONTROLS_PROPERTIES};
    VkPhysicalDeviceProperties2 more = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &floats};
    vkGetPhysicalDeviceProperties2(physical, &more);
    fprintf(stderr, "device: %s\n", more.properties.deviceName);
    if (more.properties.apiVersion < VK_API_VERSION_1_2) fail("it has no Vulkan 1.2");
    if (!floats.shaderRoundingModeRTEFloat32 || !floats.shaderSignedZeroInfNanPreserveFloat32)
        fprintf(stderr, "warning: it does not promise the float modes of the kernels, so that bits may differ\n");
    VkQueueFamilyProperties families[16];
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &family_count, families);
    while (family < family_count && !(families[family].queueFlags & VK_QUEUE_COMPUTE_BIT)) family++;
    if (family == family_count) fail("the device does not compute");
    float priority = 1.0f;
    VkDeviceQueueCreateInfo queues = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueFamilyIndex = family, .queueCount = 1,
                                      .pQueuePriorities = &priority};
    VkDeviceCreateInfo create = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .queueCreateInfoCount = 1, .pQueueCreateInfos = &queues};
    check(vkCreateDevice(physical, &create, NULL, &device), "the device does not open");
    vkGetDeviceQueue(device, family, 0, &queue);
}

static uint32_t host_visible(uint32_t allowed) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    const VkMemoryPropertyFlags seen = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    VkMemoryPropertyFlags best = seen | VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    for (int pass = 0; pass < 2; pass++, best = seen)
        for (uint32_t i = 0; i < memory.memoryTypeCount; i++)
            if ((allowed >> i & 1) && (memory.memoryTypes[i].propertyFlags & best) == best) return i;
    fail("the device has no memory that the host sees");
}

static Buffer make_buffer(uint64_t bytes) {
    if (!bytes) fail("plan.json has a buffer without bytes; export the plan again");
    Buffer made = {.bytes = bytes};
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = bytes, .usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT};
    check(vkCreateBuffer(device, &info, NULL, &made.buffer), "a buffer cannot be made");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, made.buffer, &needs);
    VkMemoryAllocateInfo allocation = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs.size,
                                       .memoryTypeIndex = host_visible(needs.memoryTypeBits)};
    check(vkAllocateMemory(device, &allocation, NULL, &made.memory), "the device has too little memory");
    check(vkBindBufferMemory(device, made.buffer, made.memory, 0), "a buffer cannot be bound");
    check(vkMapMemory(device, made.memory, 0, VK_WHOLE_SIZE, 0, &made.mapped), "a buffer cannot be mapped");
    memset(made.mapped, 0, bytes);
    return made;
}

static Buffer open_buffer(int entry) {
    Buffer made = make_buffer(number(member(entry, "bytes")));
    int file = find(entry, "file");
    if (file) {
        size_t size;
        char *bytes = read_file(string(file), &size);
        if (size != made.bytes) fail("the file of a buffer has another size; export the plan again");
        memcpy(made.mapped, bytes, size);
        free(bytes);
    }
    return made;
}

static Kernel open_kernel(int entry) {
    Kernel kernel = {.names = member(entry, "bindings")};
    kernel.bindings = (uint32_t)tokens[kernel.names].size;
    VkDescriptorSetLayoutBinding bindings[32];
    if (kernel.bindings > 32) fail("a kernel has too many bindings");
    for (uint32_t i = 0; i < kernel.bindings; i++)
        bindings[i] = (VkDescriptorSetLayoutBinding){i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, NULL};
    VkDescriptorSetLayoutCreateInfo set = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                           .bindingCount = kernel.bindings, .pBindings = bindings};
    check(vkCreateDescriptorSetLayout(device, &set, NULL, &kernel.set_layout), "bindings are refused");
    VkPipelineLayoutCreateInfo layout = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1,
                                         .pSetLayouts = &kernel.set_layout};
    check(vkCreatePipelineLayout(device, &layout, NULL, &kernel.layout), "a layout is refused");

    int spirv = find(member(entry, "modules"), "spirv");
    if (!spirv) fail("the plan has no SPIR-V; export it with --to spirv");
    size_t size;
    char *words = read_file(string(member(spirv, "file")), &size);
    VkShaderModuleCreateInfo code = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = size, .pCode = (uint32_t *)words};
    VkShaderModule module;
    check(vkCreateShaderModule(device, &code, NULL, &module), "a module is refused");
    VkComputePipelineCreateInfo pipeline = {
        VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, .stage = VK_SHADER_STAGE_COMPUTE_BIT, .module = module,
                  .pName = string(member(spirv, "entry"))},
        .layout = kernel.layout};
    check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &pipeline, NULL, &kernel.pipeline), "a kernel is refused");
    free(words);
    return kernel;
}

/* The numbers of a list, or of the lists in it: so many at least, and each below a limit. */
static List list(int value, uint32_t least, uint64_t limit) {
    int end = after(value);
    List made = {0, allocate((size_t)(end - value), sizeof(uint32_t))};
    for (int at = value + 1; at < end; at++)
        if (tokens[at].type == JSMN_PRIMITIVE) made.values[made.count++] = (uint32_t)below(at, limit);
    if (made.count < least) fail("plan.json has a list that is too short; export the plan again");
    return made;
}

static const uint64_t ANY = 1ull << 32;
static Pass open_pass(int entry, Kernel *kernels, int kernel_count, int buffer_count) {
    Pass pass = {.kernel = &kernels[below(member(entry, "kernel"), (uint64_t)kernel_count)],
                 .frames = list(member(entry, "frames"), 2, ANY), .groups = list(member(entry, "workgroups"), 3, ANY),
                 .params = list(member(entry, "params"), 1, ANY), .changes = member(entry, "changes")};
    pass.buffers = allocate(pass.kernel->bindings, sizeof(List));
    int bound = member(entry, "buffers"), role = after(pass.kernel->names + 1);
    for (uint32_t i = 1; i < pass.kernel->bindings; i++, role = after(role))
        pass.buffers[i] = list(member(bound, string(member(role, "name"))), 1, (uint64_t)buffer_count);
    return pass;
}

static int runs(const Pass *pass, uint32_t frame) {
    for (uint32_t i = 0; i + 1 < pass->frames.count; i += 2)
        if (pass->frames.values[i] <= frame && frame <= pass->frames.values[i + 1]) return 1;
    return 0;
}

/* Writes the parameters of the pass as it runs this time. */
static void write_params(Pass *pass, const Buffer *blocks) {
    uint32_t *words = (uint32_t *)((char *)blocks->mapped + pass->block);
    memcpy(words, pass->params.values, pass->params.count * 4ull);
    int change = pass->changes + 1;
    for (int i = 0; i < tokens[pass->changes].size; i++, change = after(change)) {
        int values = member(change, "values"), now = values + 1;
        uint32_t length = (uint32_t)tokens[values].size;
        for (uint32_t turn = length ? pass->times % length : 0; turn > 0; turn--) now = after(now);
        List of_now = list(now, 1, ANY);
        uint64_t first = below(member(change, "byte"), pass->params.count * 4ull) / 4;
        if (first + of_now.count > pass->params.count) fail("plan.json changes what is not there; export the plan again");
        memcpy(words + first, of_now.values, of_now.count * 4ull);
        free(of_now.values);
    }
}

static void record(Pass *pass, VkCommandBuffer commands, VkDescriptorPool pool, const Buffer *buffers, const Buffer *blocks) {
    Kernel *kernel = pass->kernel;
    VkDescriptorSetAllocateInfo allocation = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, .descriptorPool = pool,
                                              .descriptorSetCount = 1, .pSetLayouts = &kernel->set_layout};
    VkDescriptorSet set;
    check(vkAllocateDescriptorSets(device, &allocation, &set), "no descriptors");
    for (uint32_t i = 0; i < kernel->bindings; i++) {
        const List *ids = &pass->buffers[i];
        VkDescriptorBufferInfo info = {blocks->buffer, pass->block, pass->params.count * 4ull};
        if (i) info = (VkDescriptorBufferInfo){buffers[ids->values[pass->times % ids->count]].buffer, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, .dstSet = set, .dstBinding = i, .descriptorCount = 1,
                                      .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .pBufferInfo = &info};
        vkUpdateDescriptorSets(device, 1, &write, 0, NULL);
    }
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->pipeline);
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel->layout, 0, 1, &set, 0, NULL);
    vkCmdDispatch(commands, pass->groups.values[0], pass->groups.values[1], pass->groups.values[2]);
    VkMemoryBarrier barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER, .srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                         VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, NULL, 0, NULL);
}

static void upload(int uploads, uint32_t frame, const Buffer *buffers, int buffer_count) {
    static char *bytes; /* the file that was read last: most plans have one */
    static const char *name = "";
    static size_t size;
    int entry = uploads + 1;
    for (int i = 0; i < tokens[uploads].size; i++, entry = after(entry)) {
        if (number(member(entry, "frame")) != frame) continue;
        const char *file = string(member(entry, "file"));
        if (strcmp(file, name)) free(bytes), bytes = read_file(name = file, &size);
        const Buffer *target = &buffers[below(member(entry, "buffer"), (uint64_t)buffer_count)];
        uint64_t to = below(member(entry, "byte"), target->bytes), from = below(member(entry, "at"), size);
        uint64_t count = number(member(entry, "bytes"));
        if (count > target->bytes - to || count > size - from) fail("plan.json uploads what is not there; export the plan again");
        memcpy((char *)target->mapped + to, bytes + from, count);
    }
}

static void begin(VkCommandBuffer commands) {
    VkCommandBufferBeginInfo info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, .flags = 0};
    check(vkBeginCommandBuffer(commands, &info), "commands cannot be recorded");
}

/* Runs what was recorded. */
static void finish(VkCommandBuffer commands) {
    check(vkEndCommandBuffer(commands), "commands cannot be recorded");
    VkSubmitInfo info = {VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands};
    check(vkQueueSubmit(queue, 1, &info, VK_NULL_HANDLE), "the device refuses the work");
    check(vkQueueWaitIdle(queue), "the device was lost");
}

/* Rows go up in a PFM file. */
static void write_image(const char *path, const float *pixels, uint32_t width, uint32_t height) {
    FILE *file = fopen(path, "wb");
    if (!file) fail("cannot write %s", path);
    fprintf(file, "PF\n%u %u\n-1.0\n", width, height);
    for (uint32_t y = height; y-- > 0;)
        for (uint32_t x = 0; x < width; x++) fwrite(pixels + 4ull * (y * width + x), sizeof(float), 3, file);
    if (fclose(file)) fail("cannot write %s", path);
}

int main(int count, char **arguments) {
    if (count != 3) fail("usage: run_plan FOLDER IMAGE.pfm");
    folder = arguments[1];
    size_t length;
    json = read_file("plan.json", &length);
    jsmn_parser parser = {0};
    jsmn_init(&parser);
    int token_count = jsmn_parse(&parser, json, length, NULL, 0);
    tokens = allocate(token_count < 1 ? 1 : (size_t)token_count, sizeof *tokens);
    jsmn_init(&parser);
    if (jsmn_parse(&parser, json, length, tokens, (unsigned)token_count) < 1) fail("plan.json is damaged; export the plan again");
    if (!is(member(0, "format"), "restir-plan") || number(member(0, "version")) != 1) fail("plan.json is of another version");
    open_device();
    int entries = member(0, "buffers"), entry = entries + 1, buffer_count = tokens[entries].size, kernel_count;
    Buffer *buffers = allocate((size_t)buffer_count, sizeof *buffers);
    for (int i = 0; i < buffer_count; i++, entry = after(entry)) buffers[i] = open_buffer(entry);
    entries = member(0, "kernels"), entry = entries + 1, kernel_count = tokens[entries].size;
    Kernel *kernels = allocate((size_t)kernel_count, sizeof *kernels);
    for (int i = 0; i < kernel_count; i++, entry = after(entry)) kernels[i] = open_kernel(entry);
    entries = member(0, "passes"), entry = entries + 1;
    uint32_t pass_count = (uint32_t)tokens[entries].size, bindings = 0, bytes = 0;
    Pass *passes = allocate(pass_count, sizeof *passes);
    for (uint32_t i = 0; i < pass_count; i++, entry = after(entry)) {
        passes[i] = open_pass(entry, kernels, kernel_count, buffer_count);
        passes[i].block = bytes;
        bytes += (passes[i].params.count * 4 + 255) / 256 * 256; /* no device wants parameters at larger multiples */
        bindings += passes[i].kernel->bindings;
    }
    Buffer blocks = make_buffer(bytes);
    VkCommandPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO, .queueFamilyIndex = family,
                                         .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT};
    VkCommandPool pool;
    check(vkCreateCommandPool(device, &pool_info, NULL, &pool), "no commands");
    VkCommandBufferAllocateInfo info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, .commandPool = pool, .commandBufferCount = 1};
    VkCommandBuffer commands;
    check(vkAllocateCommandBuffers(device, &info, &commands), "no commands");
    VkDescriptorPoolSize sizes = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, bindings};
    VkDescriptorPoolCreateInfo descriptor_info = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, .maxSets = pass_count,
                                                  .poolSizeCount = 1, .pPoolSizes = &sizes};
    VkDescriptorPool descriptors;
    check(vkCreateDescriptorPool(device, &descriptor_info, NULL, &descriptors), "no descriptors");

    int uploads = member(0, "uploads");
    uint32_t frames = (uint32_t)number(member(0, "frames"));
    for (uint32_t frame = 0; frame < frames; frame++) {
        upload(uploads, frame, buffers, buffer_count);
        vkResetDescriptorPool(device, descriptors, 0);
        begin(commands);
        for (uint32_t i = 0, recorded = 0; i < pass_count; i++) {
            if (!runs(&passes[i], frame)) continue;
            /* drivers end work that takes seconds */
            if (recorded++ % 32 == 31) finish(commands), begin(commands);
            write_params(&passes[i], &blocks);
            record(&passes[i], commands, descriptors, buffers, &blocks);
            passes[i].times++;
        }
        finish(commands);
    }
    List size = list(member(0, "size"), 2, 1 << 16);
    Buffer *image = &buffers[below(member(member(0, "outputs") + 1, "buffer"), (uint64_t)buffer_count)];
    if (image->bytes < 16ull * size.values[0] * size.values[1]) fail("the image is smaller than plan.json says");
    write_image(arguments[2], image->mapped, size.values[0], size.values[1]);
    return 0;
}
